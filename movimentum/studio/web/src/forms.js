/* Tools that ask for words: a claim, a constant, a text. */
import {make} from "./dom.js";

export class Forms {
  constructor(app) {
    this.app = app;
  }

  /* fields: [name, label, value]; `done` gets what was filled in. */
  ask(title, fields, done, words = "") {
    const {files} = this.app, inputs = {};
    const rows = fields.map(([name, label, value]) => {
      const [row, input] = files.field(label, {value, "data-testid": `form-${name}`, spellcheck: "false", autocomplete: "off"});
      inputs[name] = input;
      return row;
    });
    files.dialog(title, [...(words ? [make("p", {class: "calm", text: words})] : []), ...rows], (place) => {
      place.close();
      done(Object.fromEntries(Object.entries(inputs).map(([name, input]) => [name, input.value.trim()])));
    }, "Add");
    Object.values(inputs)[0].select();
  }

  claim() {
    const [chosen] = this.app.selection;
    this.ask("Claim", [["text", "Claim", chosen ? chosen.anchor ? `${chosen.name}.y < 300` : `${chosen.name}.angle < 180` : ""]],
      ({text}) => { if (text) this.app.useTool("claim", [text], []); }, "An equation or an inequality that should hold in this step.");
  }

  constant() {
    this.ask("Constant with a slider", [["name", "Name", "L"], ["value", "Value", "100"], ["least", "From", "50"], ["most", "To", "150"]], ({name, value, least, most}) => {
      const numbers = [value, least, most].map(Number);
      if (numbers.every(Number.isFinite)) this.app.useTool("constant", [name], [[numbers[0], 0], [numbers[1], numbers[2]]]);
      else this.app.hint("Three numbers are needed.");
    }, "Write its name in the script, in the place of a number.");
  }
}
