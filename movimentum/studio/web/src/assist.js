/* What the editor helps with: completion, what a name is, other names, layout. The server knows; the page asks. */
import {EditorView, hoverTooltip, keymap, showTooltip} from "@codemirror/view";
import {Prec, StateEffect, StateField, Transaction} from "@codemirror/state";
import {acceptCompletion, autocompletion, completionStatus, insertCompletionText, pickedCompletion} from "@codemirror/autocomplete";
import {isolateHistory} from "@codemirror/commands";
import {button, byId, make, prose} from "./dom.js";

const BEGINS = /[\w.'{:/@]$/; // where a list opens by itself
const WORD = /^\.?\w*$/;
const ICONS = {
  thing: "class", copy: "class", anchor: "property", constant: "constant", variable: "variable", parameter: "variable", index: "variable",
  part: "namespace", kind: "type", option: "property", function: "function", clock: "keyword", member: "property", word: "keyword", value: "enum", file: "text",
};
const PAUSE = 300; // ms that the mouse rests

const shown = StateEffect.define();
/* One tooltip of ours at a time: what a name is, or the field for another name. It goes with the next change of the text. */
const bubble = StateField.define({
  create: () => null,
  update(value, change) {
    for (const effect of change.effects) if (effect.is(shown)) return effect.value;
    return change.docChanged || (change.selection && value && !value.keep) ? null : value;
  },
  provide: (field) => showTooltip.from(field),
});

export class Assist {
  constructor(app) {
    this.app = app;
    this.asked = new Map();
    this.times = [];
    const bar = byId("edit-bar");
    button(bar, "about", "About", "What the name at the cursor is (F1)", () => this.explain(), {icon: "about"});
    button(bar, "rename", "Rename", "Another name for what is at the cursor, everywhere (F2)", () => this.rename(), {icon: "rename"});
    button(bar, "format", "Format", "Lay out the script (Shift-Alt-F)", () => this.format(), {icon: "format"});
  }

  /* Of the editor. */
  get extensions() {
    const run = (act) => () => { act(); return true; };
    return [
      autocompletion({override: [(context) => this.complete(context)], activateOnTypingDelay: 30, maxRenderedOptions: 200}),
      hoverTooltip((_view, place) => this.hover(place), {hoverTime: PAUSE, hideOnChange: true}),
      bubble,
      Prec.high(keymap.of([
        {key: "Tab", run: acceptCompletion},
        {key: "F1", run: run(() => this.explain())},
        {key: "F2", run: run(() => this.rename())},
        {key: "Shift-Alt-f", run: run(() => this.format())},
        {key: "Escape", run: (view) => { const open = view.state.field(bubble) !== null; if (open) this.show(null); return open; }},
      ])),
      EditorView.updateListener.of(({view, state}) => {
        const list = completionStatus(state) && view.dom.querySelector(".cm-tooltip-autocomplete");
        if (list) list.dataset.testid = "completion";
      }),
    ];
  }

  /* --- questions; an answer is for the text that it was asked for, or there is none --- */

  ask(kind, answer, more = {}) {
    const {app} = this, rev = app.rev, before = this.asked.get(answer);
    if (before) before.done(null);
    return new Promise((done) => {
      if (!app.send({kind, rev, ...more})) { done(null); return; }
      this.asked.set(answer, {rev, place: more.place, done});
    });
  }

  told(message) {
    const asked = this.asked.get(message.kind);
    if (!asked || asked.rev !== message.rev || (asked.place !== undefined && message.place !== undefined && asked.place !== message.place)) return false;
    this.asked.delete(message.kind);
    asked.done(message.rev === this.app.rev ? message : null);
    return true;
  }

  /* The text is another one, or nobody answers. */
  forget() {
    for (const {done} of this.asked.values()) done(null);
    this.asked.clear();
  }

  at(place) {
    return {place: this.app.offsets.character(place)};
  }

  /* --- completion --- */

  async complete(context) {
    const {app} = this, {state, pos} = context;
    const line = state.doc.lineAt(pos);
    if (!context.explicit && !BEGINS.test(state.sliceDoc(line.from, pos))) return null;
    context.addEventListener("abort", () => {}, {onDocChange: true}); // another text is another question
    const begun = performance.now();
    const found = await this.ask("complete", "proposals", this.at(pos));
    if (!found || context.aborted) return null;
    this.times.push(performance.now() - begun);
    const [from, to] = app.offsets.span(found.span);
    const typed = state.sliceDoc(from, pos), {proposals} = found;
    if (!proposals.length || (proposals.length === 1 && proposals[0].text === typed && !context.explicit)) return null;
    const rest = Math.max(0, to - pos), words = proposals.every((each) => WORD.test(each.label));
    const options = proposals.map((each, k) => ({
      label: each.label, detail: each.detail, type: ICONS[each.what], boost: -k / 10,
      info: each.help ? () => make("div", {}, ...prose(each.help)) : undefined,
      apply: (view, completion, start, end) => this.insert(view, completion, each.text, start, end + rest),
    }));
    return {from, options, filter: true, validFor: words && !rest ? WORD : undefined};
  }

  insert(view, completion, text, from, to) {
    view.dispatch({
      ...insertCompletionText(view.state, text, from, Math.min(to, view.state.doc.length)),
      annotations: [pickedCompletion.of(completion), isolateHistory.of("full"), Transaction.userEvent.of("input.complete")],
    });
  }

  /* --- what a name is --- */

  async hover(place) {
    const found = await this.ask("about", "explained", this.at(place));
    return found && found.written ? this.description(found) : null;
  }

  description({span, written, paragraphs}) {
    const [pos, end] = this.app.offsets.span(span);
    const create = () => ({dom: make("div", {class: "mov-told", "data-testid": "explained", role: "status"},
      make("code", {text: written}), ...paragraphs.flatMap((text) => prose(text)))});
    return {pos, end, above: true, create};
  }

  async explain() {
    const {app} = this, place = app.editor.cursor;
    app.editor.focus();
    const found = await this.ask("about", "explained", this.at(place));
    if (found && found.written) this.show(this.description(found));
    else if (found) app.hint("No help here: move the cursor to a name or a word.");
  }

  /* What a message's code means; null if nobody answers. */
  async mean(code) {
    const found = await this.ask("meaning", "meant", {code});
    return found && found.code === code ? found.text : null;
  }

  show(tooltip) {
    this.app.editor.view.dispatch({effects: shown.of(tooltip)});
  }

  /* --- another name --- */

  async rename() {
    const {app} = this;
    const found = await this.ask("naming", "named", this.at(app.editor.cursor));
    if (!found) return;
    if (found.words) { app.hint(found.words); return; }
    const spans = found.spans.map((span) => app.offsets.span(span));
    app.editor.mark(spans.map((span) => [...span, "mov-thing"]));
    const place = app.editor.cursor;
    const [pos] = spans.find(([from, to]) => from <= place && place <= to) || [place];
    const field = make("input", {type: "text", value: found.name, "aria-label": `New name of ${found.name}`, "data-testid": "new-name", spellcheck: "false", autocapitalize: "off", autocomplete: "off", size: Math.max(12, found.name.length + 4)});
    const count = spans.length === 1 ? "1 place" : `${spans.length} places`;
    const words = make("p", {role: "alert", "data-testid": "rename-words", text: `${count}. Enter renames, Escape leaves.`});
    const leave = () => { app.editor.mark([]); this.show(null); app.editor.focus(); };
    field.addEventListener("keydown", async (event) => {
      event.stopPropagation();
      if (event.key === "Escape") { event.preventDefault(); leave(); }
      if (event.key !== "Enter" || event.isComposing) return;
      event.preventDefault();
      const made = await this.ask("rename", "edits", {place: found.place, name: field.value.trim()});
      if (!made) return;
      if (made.words) { words.textContent = made.words; words.className = "wrong"; field.focus(); return; }
      leave();
      app.edited(made);
    });
    const create = () => ({dom: make("div", {class: "mov-told mov-rename"}, field, words), mount: () => { field.focus(); field.select(); }});
    this.show({pos, above: false, keep: true, create});
  }

  /* --- layout --- */

  async format() {
    const {app} = this, {editor} = app;
    editor.focus();
    const made = await this.ask("format", "edits");
    if (!made) return;
    const place = editor.ink();
    app.edited(made);
    if (made.edits.length) editor.toInk(place);
  }
}
