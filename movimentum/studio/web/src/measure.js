/* Length and angle beside the pencil. Digits that are typed while something is drawn set them: Tab goes to the angle. */
import {byId, make} from "./dom.js";

const FIELDS = ["length", "angle"];

export class Measure {
  constructor(app) {
    this.app = app;
    this.clear();
  }

  clear() {
    this.typed = {length: "", angle: ""};
    this.field = "length";
    this.from = null;
    byId("measure").hidden = true;
  }

  get fixed() {
    return FIELDS.some((field) => this.value(field) !== null);
  }

  value(field) {
    const text = this.typed[field];
    return text !== "" && Number.isFinite(Number(text)) ? Number(text) : null;
  }

  /* Where the line from `from` ends, if `at` is where the pencil is. */
  place(from, at) {
    const [dx, dy] = [at[0] - from[0], at[1] - from[1]];
    const length = this.value("length") ?? Math.hypot(dx, dy);
    const angle = this.value("angle") ?? Math.atan2(dy, dx) * 180 / Math.PI;
    if (!this.fixed) return at;
    const turn = angle * Math.PI / 180;
    return [from[0] + length * Math.cos(turn), from[1] + length * Math.sin(turn)].map((value) => Number(value.toFixed(6)));
  }

  /* Beside the pencil. */
  show(from, at, words = []) {
    const {stage} = this.app, place = byId("measure");
    this.from = from;
    this.at = at;
    const [dx, dy] = [at[0] - from[0], at[1] - from[1]];
    const shown = {length: Math.hypot(dx, dy).toFixed(1), angle: `${(Math.atan2(dy, dx) * 180 / Math.PI).toFixed(1)}°`};
    place.replaceChildren(...FIELDS.map((field) => make("span", {class: this.typed[field] !== "" || (this.fixed && field === this.field) ? "typed" : "", "data-testid": `measure-${field}`,
      text: this.typed[field] !== "" ? `${this.typed[field]}${field === "angle" ? "°" : ""}` : shown[field]})), ...(words.length ? [make("i", {text: words.join(", ")})] : []));
    place.hidden = false;
    const [x, y] = stage.local(at);
    place.style.left = `${Math.min(x + 16, stage.canvas.clientWidth - place.offsetWidth - 4)}px`;
    place.style.top = `${Math.max(4, Math.min(y - 36, stage.canvas.clientHeight - place.offsetHeight - 4))}px`;
  }

  /* A key while something is drawn; whether it was for this. */
  key(event) {
    if (!this.from || event.ctrlKey || event.metaKey || event.altKey) return false;
    const {key} = event, {field} = this;
    if (/^[0-9]$/.test(key) || (key === "." && !this.typed[field].includes(".")) || (key === "-" && field === "angle" && !this.typed[field])) this.typed[field] += key;
    else if (key === "Backspace" && this.typed[field]) this.typed[field] = this.typed[field].slice(0, -1);
    else if (key === "Tab") this.field = field === "length" ? "angle" : "length";
    else if (key === "Enter" && this.fixed) { this.app.pointer.finish(); return true; }
    else return false;
    this.app.pointer.again();
    return true;
  }
}
