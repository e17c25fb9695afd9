/* The script's file: saving, changes on the disk, the start page, rendering. */
import {button, byId, make} from "./dom.js";

export class FileWork {
  constructor(app) {
    this.app = app;
    this.name = "";
    this.version = "";
    this.base = "";
    this.newline = "\n";
    this.job = 0;
    this.known = false;
    const bar = byId("file-bar");
    button(bar, "open", "Open", "Open a script or a linkage file (Ctrl-O)", () => this.askOpen());
    button(bar, "save", "Save", "Save (Ctrl-S)", () => this.save());
    button(bar, "save-as", "Save as…", "Save under another name", () => this.askSave());
    button(bar, "export", "Linkage…", "Save the scene as a linkage file", () => this.askLinkage());
    button(bar, "render", "Render…", "Render to a file", () => this.askRender());
    button(bar, "help", "?", "Keys", () => this.showKeys());
    window.addEventListener("pagehide", () => this.keepDraft());
    window.addEventListener("beforeunload", (event) => { if (this.dirty && this.app.editor.text.trim()) event.preventDefault(); });
  }

  get text() {
    return this.newline === "\n" ? this.app.editor.text : this.app.editor.text.replaceAll("\n", this.newline);
  }

  get dirty() {
    return this.known && this.app.editor.text !== this.base;
  }

  plain(text) {
    this.newline = text.includes("\r\n") ? "\r\n" : text.includes("\r") && !text.includes("\n") ? "\r" : "\n";
    return text.replace(/\r\n?/g, "\n");
  }

  changed() {
    byId("dirty").hidden = !this.dirty;
    if (this.app.editor.text) byId("start").hidden = true;
  }

  named(name) {
    this.name = name;
    byId("name").textContent = name || "untitled";
    document.title = `${name || "untitled"} – Movimentum Studio`;
    this.changed();
  }

  welcome({name, text, version, folder, gallery, recent, formats, trouble}) {
    this.folder = folder;
    this.formats = formats;
    if (this.known) { // the server is back: the page has the text
      if (name && version !== this.version) this.diskChanged({text, version, trouble});
      this.app.submit();
      return;
    }
    this.known = true;
    this.take(name, text, version);
    if (!name) this.app.start.show(gallery, recent);
    this.takeDraft();
    if (trouble) this.app.hint(trouble);
  }

  /* A text that was not saved outlives a reload of the page. */
  keepDraft() {
    const {name, version} = this;
    if (this.dirty) sessionStorage.setItem("draft", JSON.stringify({name, version, text: this.app.editor.text}));
    else sessionStorage.removeItem("draft");
  }

  takeDraft() {
    const draft = JSON.parse(sessionStorage.getItem("draft") || "null");
    sessionStorage.removeItem("draft");
    if (!draft || draft.name !== this.name || draft.version !== this.version) return;
    this.app.editor.replace(draft.text);
    this.app.hint("Your unsaved text was restored.");
  }

  take(name, text, version) {
    const plain = this.plain(text);
    this.base = plain;
    this.version = version;
    this.named(name);
    if (this.app.editor.text === plain) { this.app.rev += 1; this.app.submit(); }
    else this.app.editor.replace(plain, {history: this.app.rev > 0});
    this.changed();
  }

  /* --- the disk --- */

  diskChanged({text, version, trouble, renamed}) {
    if (renamed) {
      this.version = "";
      this.notice(`${this.name} is called ${renamed} now.`, [
        [`Continue with ${renamed}`, () => this.app.send({kind: "follow", name: renamed})],
        [`Keep ${this.name}`, () => {}],
      ]);
      return;
    }
    if (trouble) {
      this.version = "";
      this.notice(`${trouble}. Your text is kept here; Save writes it again.`, [["Fine", () => {}]]);
      return;
    }
    const plain = text.replace(/\r\n?/g, "\n");
    if (plain === this.app.editor.text || !this.dirty) {
      this.notice("");
      this.plain(text);
      this.base = plain;
      this.version = version;
      this.app.editor.replace(plain);
      this.changed();
      return;
    }
    this.conflict(text, version);
  }

  conflict(text, version) {
    this.notice("Both the file and your text have changed.", [
      ["Keep mine", () => { this.version = version; this.base = this.plain(text); this.changed(); }],
      ["Load the file", () => { this.version = version; this.base = this.plain(text); this.app.editor.replace(this.base); this.changed(); }],
    ]);
  }

  notice(words, choices = []) {
    const place = byId("notice");
    place.hidden = !words;
    place.replaceChildren(make("span", {text: words}), ...choices.map(([text, act], k) => make("button", {
      type: "button", text, "data-testid": `choice-${k}`, onclick: () => { place.hidden = true; act(); },
    })));
  }

  save(name = "", force = false) {
    const sent = this.app.send({kind: "save", text: this.text, name, base: this.version, force});
    if (!sent) this.app.hint("Not saved: there is no connection.");
    this.saving = this.app.editor.text;
  }

  saveDone({state, name, version, text, words}) {
    if (state === "saved") {
      this.base = this.saving;
      this.version = version;
      this.named(name);
      this.notice("");
      this.app.hint(words || `Saved ${name}.`);
    } else if (state === "renamed") {
      this.base = this.plain(text);
      this.version = version;
      this.named(name);
      this.app.hint(`The file is called ${name} now.`);
    } else if (state === "conflict") {
      this.notice(words || "The file has changed on the disk since you opened it.", [
        ["Save my text", () => this.save(name, true)],
        ["Load the file", () => this.take(name, text, version)],
        ["Not now", () => {}],
      ]);
    } else this.app.hint(words);
  }

  opened({name, text, version, words}) {
    byId("start").hidden = true;
    byId("dialog").close();
    if (words) { this.app.hint(words); if (!text) return; }
    this.take(name, text, version);
    if (!name) { this.base = ""; this.changed(); }
    this.app.stage.fit();
    this.app.clock.seek(0);
  }

  /* --- dialogs --- */

  dialog(title, fields, done, action) {
    const place = byId("dialog");
    const form = make("form", {method: "dialog"}, make("h2", {text: title}), ...fields);
    const ok = make("button", {type: "submit", class: "main", "data-testid": "dialog-ok", text: action});
    form.append(make("div", {class: "bar"}, ok, make("button", {type: "button", "data-testid": "dialog-cancel", text: "Cancel", onclick: () => place.close()})));
    form.addEventListener("submit", (event) => { event.preventDefault(); done(place); });
    place.replaceChildren(form);
    place.showModal();
  }

  field(label, attributes) {
    const input = make("input", {"aria-label": label, ...attributes});
    return [make("label", {}, make("span", {text: label}), input), input];
  }

  stem() {
    return (this.name || "untitled.mov").replace(/\.[^.]*$/, "");
  }

  askSave() {
    const [row, input] = this.field("Name", {value: this.name || "untitled.mov", required: true, "data-testid": "save-name"});
    this.dialog("Save as", [make("p", {text: `In ${this.folder}`}), row], (place) => { place.close(); this.save(input.value.trim()); }, "Save");
  }

  askOpen() {
    const [row, input] = this.field("File", {value: "", required: true, placeholder: "crank.mov, peaucellier.txt", "data-testid": "open-name"});
    const words = `A script, or a linkage or mechanism file, in ${this.folder}`;
    const names = make("div", {class: "names", "data-testid": "open-names"});
    this.listed = (found) => names.replaceChildren(...found.names.map((name) => make("button", {type: "button", text: name, onclick: () => { input.value = name; }, ondblclick: () => input.form.requestSubmit()})));
    this.app.send({kind: "files"});
    this.dialog("Open", [make("p", {text: words}), names, row], () => {
      if (this.dirty && !window.confirm("Your text is not saved. Open another file?")) return;
      this.app.send({kind: "open", source: "folder", number: 0, name: input.value.trim()});
    }, "Open");
  }

  askLinkage() {
    const [row, input] = this.field("File", {value: `${this.stem()}.txt`, required: true, "data-testid": "linkage-name"});
    this.dialog("Save as a linkage file", [make("p", {text: "Vertices and rods at the time shown."}), row], (place) => {
      place.close();
      this.app.send({kind: "linkage", text: this.app.editor.text, name: input.value.trim(), time: this.app.clock.time});
    }, "Save");
  }

  askRender() {
    const formats = make("select", {"aria-label": "Format", "data-testid": "render-format"}, ...this.formats.map((each) => make("option", {value: each, text: each.slice(1)})));
    const [row, input] = this.field("File", {value: `${this.stem()}.gif`, required: true, "data-testid": "render-name"});
    formats.addEventListener("change", () => { input.value = input.value.replace(/(\.[^.]*)?$/, formats.value); });
    const [scaleRow, scale] = this.field("Scale", {type: "number", value: "1", min: "0.1", max: "8", step: "any", "data-testid": "render-scale"});
    const [stillRow, still] = this.field(`A still at ${this.app.clock.time.toFixed(2)}`, {type: "checkbox", "data-testid": "render-still"});
    const format = make("label", {}, make("span", {text: "Format"}), formats);
    this.dialog("Render", [format, row, scaleRow, stillRow], (place) => {
      place.close();
      this.render(input.value.trim(), Number(scale.value) || 1, still.checked ? this.app.clock.time : null);
    }, "Render");
  }

  render(name, scale, at) {
    this.renders(name, (job) => ({kind: "render", job, text: this.app.editor.text, name, scale, at}));
  }

  renders(name, message) {
    this.job += 1;
    const job = this.job;
    this.bar = make("progress", {"data-testid": "progress", max: 1, value: 0, "aria-label": "Rendering"});
    this.notice(`Rendering ${name} …`, [["Cancel", () => this.app.send({kind: "cancel", job})]]);
    byId("notice").insertBefore(this.bar, byId("notice").lastChild);
    byId("notice").lastChild.dataset.testid = "cancel-render";
    this.app.send(message(job));
  }

  renderAdvanced({job, state, done, total, name, words}) {
    if (job !== this.job) return;
    if (state === "running") {
      this.bar.max = Math.max(1, total);
      this.bar.value = done;
      return;
    }
    this.notice(state === "done" ? `${name} is written. ${words}` : state === "cancelled" ? "Rendering was cancelled." : words, [["Fine", () => {}]]);
    byId("notice").dataset.state = state;
  }

  showKeys() {
    const rows = [["Space", "play or pause (outside the script)"], ["← →", "one frame"], ["Home End", "first and last frame"],
      ["V A R G F T U D E", "tools: select, anchor, rod, angle, fix, attract, turn, delete, edit shape"],
      [". and ,", "the next and the previous point"], ["Shift and arrows", "move the cross; with Select, the point it is at"], ["Enter", "use the tool where the cross is"], ["+ − 0", "zoom in, out, fit"],
      ["Q", "the next view: plain, names, free motions"], ["N P L M S I", "names, points, traces, free motions, velocities, information"],
      ["W", "full screen"], ["C Shift-C", "copy the picture as PNG, as SVG"], ["Shift-S", "save what is on show as PNG"],
      ["K", "record what is done by hand; again: save it as a film"], ["X", "clear the sheet"], ["Delete", "remove what is selected"],
      ["Ctrl-space", "in the script: what may be written here"], ["F1 F2 Shift-Alt-F", "in the script: what a name is, rename, format"],
      ["Alt and drag on a number", "changes it"], ["Escape", "let go; in the script: back to the picture"],
      ["Ctrl-S Ctrl-O", "save, open"], ["Ctrl-Z Ctrl-Y", "undo, redo"], ["Ctrl-E", "to the script"]];
    const place = byId("dialog");
    place.replaceChildren(make("h2", {text: "Keys"}), make("dl", {}, ...rows.flatMap(([key, words]) => [make("dt", {text: key}), make("dd", {text: words})])),
      make("div", {class: "bar"}, make("button", {type: "button", class: "main", text: "Close", onclick: () => place.close()})));
    place.showModal();
  }
}
