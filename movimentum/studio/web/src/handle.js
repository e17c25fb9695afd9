/* A handle at the number under the mouse (or at the cursor, for a finger): dragged sideways, it changes the number. */
import {face, make} from "./dom.js";

const NUMBER = /\d+\.\d+|\d+\.?(?![\w.])|\.?\d+/g;
const PER = 2; // pixels to a step
const MOST_DIGITS = 8;

/* {from, to, value, digits, write} of the number at a place of a line; its sign is its own, or that of a sum before it. */
export function numberAt(line, place) {
  for (const each of line.matchAll(NUMBER)) {
    const from = each.index, to = from + each[0].length;
    if (place < from || place > to || /[A-Za-z_]$/.test(line.slice(0, from)) || /^[A-Za-z_]/.test(line.slice(to))) continue;
    const digits = Math.min(MOST_DIGITS, (each[0].split(".")[1] || "").length), size = Number(each[0]);
    const sign = /([+-])(\s*)$/.exec(line.slice(0, from));
    const before = sign ? line.slice(0, sign.index) : "";
    const written = (value) => Math.abs(value).toFixed(digits);
    const sum = sign && /[\w)\].']\s*$/.test(before);
    if (sum) { // a sum's sign turns with the value
      const low = sign.index;
      return {from: low, to, value: sign[1] === "-" ? -size : size, digits, write: (value) => `${value < 0 ? "-" : "+"}${sign[2]}${written(value)}`};
    }
    const low = sign ? sign.index : from, least = /@\s*$/.test(line.slice(0, low)) ? 0 : -Infinity;
    return {from: low, to, value: sign && sign[1] === "-" ? -size : size, digits, write: (value) => {
      const kept = Math.max(least, value);
      return `${kept < 0 && Number(written(kept)) !== 0 ? "-" : ""}${written(kept)}`;
    }};
  }
  return null;
}

export class Handle {
  constructor(editor) {
    this.editor = editor;
    this.button = make("button", {type: "button", class: "mov-handle", hidden: true, "data-testid": "number-handle", "aria-hidden": "true", tabindex: "-1", title: "Drag to change the number"});
    face(this.button, "dimension");
    this.button.addEventListener("pointerdown", (event) => { if (this.found) this.pull(event, this.found); });
    document.body.append(this.button);
  }

  find(place) {
    const line = this.editor.view.state.doc.lineAt(place), found = numberAt(line.text, place - line.from);
    return found && {...found, from: found.from + line.from, to: found.to + line.from};
  }

  near(event) {
    if (this.pulling || event.buttons) return;
    const {view} = this.editor, place = view.posAtCoords({x: event.clientX, y: event.clientY});
    const found = place === null ? null : this.find(place);
    const box = found && view.coordsAtPos(found.to), start = found && view.coordsAtPos(found.from);
    if (!found || !box || !start || event.clientX < start.left - 4 || event.clientX > box.right + 4) {
      const own = this.button.getBoundingClientRect();
      if (!(event.clientX > own.left - 12 && event.clientX < own.right + 12 && event.clientY > own.top - 12 && event.clientY < own.bottom + 12)) this.hide();
      return;
    }
    this.show(found);
  }

  /* For fingers: the number that the cursor is in. */
  changed({state}) {
    if (this.pulling) return;
    this.hide();
    if (!window.matchMedia("(pointer: coarse)").matches) return;
    const found = this.find(state.selection.main.head);
    if (found) requestAnimationFrame(() => this.show(found));
  }

  show(found) {
    const {view} = this.editor;
    const [a, b] = [view.coordsAtPos(found.from), view.coordsAtPos(Math.min(found.to, view.state.doc.length))];
    if (!a || !b) return;
    this.found = found;
    this.button.hidden = false;
    this.button.style.left = `${(a.left + b.right) / 2 - this.button.offsetWidth / 2}px`;
    this.button.style.top = `${a.top - this.button.offsetHeight}px`;
  }

  hide() {
    this.button.hidden = true;
    this.found = null;
  }

  /* With Alt, the number itself is the handle. */
  grab(event) {
    if (!event.altKey || event.button !== 0) return false;
    const place = this.editor.view.posAtCoords({x: event.clientX, y: event.clientY});
    const found = place === null ? null : this.find(place);
    if (!found) return false;
    this.pull(event, found);
    return true;
  }

  pull(event, {from, to, value, digits, write}) {
    const live = this.editor.scrubbed([from, to]);
    this.pulling = true;
    const move = (each) => live.set(write(Number((value + Math.round((each.clientX - event.clientX) / PER) * 10 ** -digits).toFixed(digits))));
    const end = () => {
      window.removeEventListener("pointermove", move);
      window.removeEventListener("pointerup", end);
      window.removeEventListener("pointercancel", end);
      live.done();
      this.pulling = false;
      this.hide();
    };
    window.addEventListener("pointermove", move);
    window.addEventListener("pointerup", end);
    window.addEventListener("pointercancel", end);
    event.preventDefault();
  }
}
