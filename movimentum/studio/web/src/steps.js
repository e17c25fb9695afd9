/* Undo as a list: what each step was; a click goes back to it. */
import {redoDepth, undoDepth} from "@codemirror/commands";
import {make} from "./dom.js";

const NAMES = {
  "input.type": "Typing", "input.complete": "Completion", "input.paste": "Pasting", "input.scrub": "A number", "input.drop": "Moving text",
  delete: "Deleting", move: "Moving lines", "input.indent": "Indentation",
};

export class Steps {
  constructor(app) {
    this.app = app;
    this.list = []; // what each step was, the oldest first
  }

  /* After a change of the text. */
  changed(update) {
    const depth = undoDepth(update.state);
    if (update.transactions.some((each) => each.isUserEvent("undo") || each.isUserEvent("redo"))) return;
    this.list.length = Math.min(this.list.length, depth);
    if (depth === 0) return;
    const event = update.transactions.map((each) => Object.keys(NAMES).find((name) => each.isUserEvent(name))).find(Boolean);
    while (this.list.length < depth) this.list.push("");
    this.list[depth - 1] = this.next || NAMES[event] || this.list[depth - 1] || "Edit";
    this.next = "";
  }

  show() {
    const {app} = this, {view} = app.editor, now = undoDepth(view.state), all = now + redoDepth(view.state);
    const rows = ["As it was opened", ...Array.from({length: all}, (_, k) => this.list[k] || "Edit")];
    const place = app.files.sheet("Steps", [make("ol", {class: "steps"}, ...rows.map((words, k) => make("li", {},
      make("button", {type: "button", "data-testid": `step-${k}`, class: k === now ? "now" : k > now ? "future" : "", text: `${k}. ${words}`, onclick: () => { place.close(); this.go(k); }}))))]);
    const current = place.querySelector(".now");
    if (current) current.focus();
  }

  go(wanted) {
    const {editor} = this.app;
    for (let left = 1000; left > 0 && undoDepth(editor.view.state) > wanted; left -= 1) editor.undo();
    for (let left = 1000; left > 0 && undoDepth(editor.view.state) < wanted && redoDepth(editor.view.state) > 0; left -= 1) editor.redo();
  }
}
