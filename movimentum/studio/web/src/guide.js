/* For a first mechanism: what to do next, as long as it is not done. */
import {byId, glyph, make} from "./dom.js";

export class Guide {
  constructor(app) {
    this.app = app;
    this.on = false;
  }

  begin() {
    this.on = true;
    this.dragged = false;
    this.show();
  }

  end() {
    this.on = false;
    byId("guide").hidden = true;
    this.suggest(null);
  }

  hasDragged() {
    if (!this.on || this.dragged) return;
    this.dragged = true;
    this.show();
  }

  /* [done, words, tool] of each step, from what the text has. */
  steps() {
    const {scene} = this.app.stage, {text} = this.app.editor;
    const things = scene && text.trim() ? scene.things : [];
    const count = (shape) => things.filter((thing) => thing.shape === shape).length;
    const pins = text.slice(Math.max(0, text.search(/^\s*@/m))).match(/\w+\.\w+ *= *\[/g) || [];
    return [
      [count("disc") >= 4, "Anchor: click four places.", "anchor"],
      [count("bar") >= 3, "Rod: drag from the first point to the second, then to the third, then to the fourth.", "rod"],
      [pins.length >= 2, "Fix: click the first point and the last one. They are the ground.", "fix"],
      [this.dragged, "Select: drag one of the other points. It moves!", "select"],
      [/\.angle *=[^;]*\.t/.test(text), "Turn: click the shortest rod at the ground. It turns by itself; space pauses.", "turn"],
    ];
  }

  show() {
    const place = byId("guide");
    place.hidden = !this.on;
    if (!this.on) return;
    const steps = this.steps(), next = steps.findIndex(([done]) => !done);
    if (next >= 0 && steps.at(-1)[0]) { this.end(); return; } // it turns, and was made in another way
    const close = make("button", {type: "button", "aria-label": "Close the guide", "data-testid": "guide-close", onclick: () => this.end()}, glyph("close"));
    const words = next < 0
      ? make("p", {text: "You have made a mechanism. Change a number in its text and see what happens. Save keeps it, Render makes a film of it."})
      : make("p", {}, make("b", {text: `${next + 1} of ${steps.length} `}), make("span", {text: steps[next][1]}));
    place.replaceChildren(words, close);
    this.suggest(next < 0 ? null : steps[next][2]);
  }

  suggest(tool) {
    for (const [name, made] of Object.entries(this.app.controls.buttons)) made.classList.toggle("suggested", name === tool);
  }
}
