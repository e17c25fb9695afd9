/* The script: CodeMirror with the language's words, squiggles, and marks from the picture. */
import {basicSetup, EditorView} from "codemirror";
import {EditorState, StateEffect, StateField, Transaction} from "@codemirror/state";
import {Decoration, keymap} from "@codemirror/view";
import {HighlightStyle, StreamLanguage, syntaxHighlighting} from "@codemirror/language";
import {indentWithTab, isolateHistory, redo, undo} from "@codemirror/commands";
import {setDiagnostics} from "@codemirror/lint";
import {Tag} from "@lezer/highlight";
import {TOKENS} from "./tokens.js";
import {changesBetween} from "./lines.js";
import {Handle} from "./handle.js";

const rules = TOKENS.map(([pattern, scope]) => [new RegExp(pattern, "y"), scope.replaceAll(".", "-")]);
const tags = Object.fromEntries([...new Set([...rules.map(([, scope]) => scope), "comment-block"])].map((scope) => [scope, Tag.define()]));

const language = StreamLanguage.define({
  name: "movimentum",
  startState: () => ({comment: false}),
  token(stream, state) {
    if (state.comment) {
      if (stream.skipTo("*/")) { stream.pos += 2; state.comment = false; } else stream.skipToEnd();
      return "comment-block";
    }
    if (stream.eatSpace()) return null;
    if (stream.match("/*")) { state.comment = true; return "comment-block"; }
    for (const [rule, scope] of rules) {
      rule.lastIndex = stream.pos;
      const found = rule.exec(stream.string);
      if (found && found[0]) { stream.pos += found[0].length; return scope; }
    }
    stream.next();
    return null;
  },
  languageData: {commentTokens: {line: "//", block: {open: "/*", close: "*/"}}},
  tokenTable: tags,
});

const colors = (scope) => {
  if (scope.startsWith("comment")) return "var(--comment)";
  if (scope.startsWith("string")) return "var(--string)";
  if (scope.startsWith("constant")) return "var(--number)";
  if (scope.startsWith("keyword-operator") || scope === "punctuation") return "var(--sign)";
  if (scope.startsWith("keyword") || scope.startsWith("storage")) return "var(--keyword)";
  if (scope.startsWith("support") || scope.startsWith("entity")) return "var(--member)";
  if (scope.startsWith("variable-language")) return "var(--clock)";
  return "var(--ink)";
};
const highlight = HighlightStyle.define(Object.entries(tags).map(([scope, tag]) => ({tag, color: colors(scope)})));

const marked = StateEffect.define();
const marks = StateField.define({
  create: () => Decoration.none,
  update(value, change) {
    let found = value.map(change.changes);
    for (const effect of change.effects) {
      if (effect.is(marked)) {
        found = Decoration.set(effect.value.filter(([from, to]) => to > from)
          .map(([from, to, name]) => Decoration.mark({class: name}).range(from, to)), true);
      }
    }
    return found;
  },
  provide: (field) => EditorView.decorations.from(field),
});

export class Editor {
  constructor(parent, {changed, moved, extensions}) {
    this.quiet = false;
    this.handle = new Handle(this);
    this.view = new EditorView({
      parent,
      state: EditorState.create({
        doc: "",
        extensions: [
          extensions,
          basicSetup,
          keymap.of([indentWithTab]),
          language,
          syntaxHighlighting(highlight),
          marks,
          EditorView.lineWrapping,
          EditorView.domEventHandlers({mousedown: (event) => this.handle.grab(event), mousemove: (event) => { this.handle.near(event); }, scroll: () => { this.handle.hide(); }}),
          EditorView.cspNonce.of(document.querySelector('meta[name="movimentum-nonce"]').content),
          EditorView.contentAttributes.of({"aria-label": "Script", spellcheck: "false"}),
          EditorView.updateListener.of((update) => {
            if (update.docChanged || update.selectionSet) this.handle.changed(update);
            if (update.docChanged) changed(update);
            else if (update.selectionSet && !this.quiet) moved();
          }),
        ],
      }),
    });
  }

  get text() {
    return this.view.state.doc.toString();
  }

  get cursor() {
    return this.view.state.selection.main.head;
  }

  get selected() {
    const {from, to} = this.view.state.selection.main;
    return this.view.state.sliceDoc(from, to);
  }

  scroll(top) {
    if (top !== null) this.view.scrollDOM.scrollTop = top;
    return this.view.scrollDOM.scrollTop;
  }

  /* Edits that are one step to undo; offsets are the editor's. */
  apply(edits, select = null, event = "input.studio") {
    const changes = edits.map(({from, to, text}) => ({from, to, insert: text}));
    this.view.dispatch({
      changes,
      annotations: [isolateHistory.of("full"), Transaction.userEvent.of(event)],
    });
    if (select) this.select(select);
  }

  /* A passage that is written again and again while a hand moves; in the end that is one step to undo. */
  scrubbed([from, to]) {
    const before = this.view.state.sliceDoc(from, to);
    let end = to;
    const put = (insert, history) => {
      const annotations = [Transaction.addToHistory.of(history), isolateHistory.of("full"), Transaction.userEvent.of("input.scrub")];
      this.view.dispatch({changes: {from, to: end, insert}, annotations});
      end = from + insert.length;
    };
    return {
      set: (text) => { if (text !== this.view.state.sliceDoc(from, end)) put(text, false); },
      done: () => {
        const after = this.view.state.sliceDoc(from, end);
        if (after === before) return;
        put(before, false);
        put(after, true);
      },
    };
  }

  /* Another text, line by line with as little change as possible: cursor and scroll stay at the lines they are at. */
  replace(text, {history = true} = {}) {
    const old = this.text;
    if (old === text) return;
    const {view} = this, top = view.lineBlockAtHeight(view.scrollDOM.scrollTop), off = view.scrollDOM.scrollTop - top.top;
    const changes = view.state.changes(changesBetween(old, text));
    view.dispatch({changes, annotations: [isolateHistory.of("full"), Transaction.addToHistory.of(history)]});
    view.scrollDOM.scrollTop = view.lineBlockAt(Math.min(changes.mapPos(top.from, 1), view.state.doc.length)).top + off;
  }

  select([from, to], {scroll = true} = {}) {
    this.quiet = true;
    const length = this.view.state.doc.length;
    const selection = {anchor: Math.min(to, length), head: Math.min(from, length)};
    this.view.dispatch({selection, scrollIntoView: scroll});
    this.quiet = false;
  }

  /* How many letters that are no white space stand before the cursor: where it is in any layout. */
  ink() {
    return this.text.slice(0, this.cursor).replace(/\s/g, "").length;
  }

  toInk(count) {
    let place = 0, left = count;
    for (const letter = /\S/g; left > 0 && letter.test(this.text); left -= 1) place = letter.lastIndex;
    this.select([place, place]);
  }

  mark(spans) {
    const length = this.view.state.doc.length;
    const kept = spans.filter(([from, to]) => from < to && to <= length).sort((a, b) => a[0] - b[0]);
    this.view.dispatch({effects: marked.of(kept)});
  }

  /* Squiggles; `found` have offsets of the editor. */
  squiggle(found) {
    const length = this.view.state.doc.length;
    const told = found.filter((item) => item.from !== null).map((item) => {
      const from = Math.min(item.from, length);
      return {
        from,
        to: Math.min(Math.max(item.to, from), length),
        severity: item.severity === "note" ? "info" : item.severity,
        message: [item.message, ...item.helps.map((help) => `help: ${help}`)].join("\n"),
        source: item.code,
      };
    });
    this.view.dispatch(setDiagnostics(this.view.state, told));
  }

  undo() { undo(this.view); }

  redo() { redo(this.view); }

  focus() { this.view.focus(); }
}
