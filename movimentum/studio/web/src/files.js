/* The script's file: saving, changes on the disk, the start page, rendering. */
import {button, byId, make, menu} from "./dom.js";
import {inline} from "./panel.js";
import {link, shared} from "./share.js";

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
    menu(bar, "menu", "", "File", "menu", [
      ["new", "new", "New", "", () => this.startAgain("blank")],
      ["examples", "examples", "Examples …", "", () => this.startAgain("")],
      ["save-as", "save", "Save as …", "", () => this.askSave()],
      null,
      ["export", "export", "Linkage file …", "", () => this.askLinkage()],
      ["save-page", "page", "Save as page …", "", () => this.askPage()],
      ["copy-link", "share", "Copy link", "", () => this.copyLink()],
      ["empty", "clear", "Empty the script", "X", () => app.controls.clear()],
      null,
      ["copy-png", "copy", "Copy the picture as PNG", "C", () => app.copies.copyPng()],
      ["copy-svg", "copy", "Copy the picture as SVG", "Shift-C", () => app.copies.copySvg()],
      ["screenshot", "camera", "Screenshot", "Shift-S", () => app.copies.screenshot()],
    ]);
    button(bar, "open", "Open", "Open a script or a linkage file (Ctrl-O)", () => this.askOpen(), {icon: "open"});
    button(bar, "save", "Save", "Save (Ctrl-S)", () => this.save(), {icon: "save"});
    button(bar, "render", "Render", "Render to a file", () => this.askRender(), {icon: "render"});
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
    Object.assign(this, {folder, formats, gallery, recent});
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
    this.takeShared(window.location.href);
    window.addEventListener("hashchange", () => this.takeShared(window.location.href));
  }

  /* A script that stands behind the # of an address; the address loses it, so that a reload does not bring it again. */
  async takeShared(address) {
    try {
      const text = await shared(address);
      if (text === null) return false;
      if (address === window.location.href) window.history.replaceState(null, "", window.location.pathname + window.location.search);
      if (this.dirty && this.app.editor.text.trim() && !window.confirm("Your text is not saved. Open the shared script?")) return true;
      this.opened({name: "", text, version: "", words: ""});
      this.app.hint("This script came with a link. Save gives it a file.");
    } catch {
      this.app.hint("The script in this link is broken: copy the link again, whole.");
    }
    return true;
  }

  async copyLink() {
    const address = await link(this.app.editor.text);
    try {
      await navigator.clipboard.writeText(address);
      this.app.hint("A link with the whole script is on the clipboard.");
    } catch {
      const [row, input] = this.field("Link", {value: address, readonly: true, "data-testid": "link-text"});
      this.sheet("Link", [make("p", {text: "The browser does not let the page copy it. Copy it from here."}), row]);
      input.select();
    }
  }

  /* The page of scripts again. */
  startAgain(source) {
    if (this.dirty && this.app.editor.text.trim() && !window.confirm("Your text is not saved. Leave it?")) return;
    if (source === "blank") { this.app.send({kind: "open", source: "blank", number: 0, name: ""}); return; }
    this.app.start.show(this.gallery, this.recent, Boolean(this.app.editor.text));
    this.app.send({kind: "start"});
  }

  /* A text that was dropped on the page. */
  openText(text, name) {
    if (this.dirty && this.app.editor.text.trim() && !window.confirm("Your text is not saved. Open another file?")) return;
    if (!name.endsWith(".mov")) { this.app.hint(`Put ${name} into the script's folder, then open it there.`); return; }
    this.opened({name: "", text, version: "", words: ""});
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
    place.replaceChildren(make("span", {}, ...inline(words)), ...choices.map(([text, act], k) => make("button", {
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

  /* Something to look at, and to close. */
  sheet(title, rows) {
    const place = byId("dialog");
    place.replaceChildren(make("h2", {text: title}), ...rows, make("div", {class: "bar"}, make("button", {type: "button", class: "main", "data-testid": "sheet-close", text: "Close", onclick: () => place.close()})));
    place.showModal();
    return place;
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
      const wanted = input.value.trim();
      if (wanted.includes("#")) { byId("dialog").close(); this.base = this.app.editor.text; this.takeShared(wanted); return; }
      this.app.send({kind: "open", source: "folder", number: 0, name: wanted});
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

  askPage() {
    const [row, input] = this.field("File", {value: `${this.stem()}.html`, required: true, "data-testid": "page-name"});
    this.dialog("Save as page", [make("p", {text: "One file that plays offline in any browser."}), row], (place) => { place.close(); this.render(input.value.trim(), 1, null); }, "Save");
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
      ["V E", "tools: select, edit shape"], ["A R B", "tools: anchor, rod, plate"], ["F G U T D", "tools: fix, angle, turn, attract, delete"],
      ["0–9 Tab Enter", "while drawing: length, angle, done"], ["Alt", "while drawing: snap to nothing"],
      ["Shift and click, or drag", "select several"], ["Y", "keep the pose that your hand has made"],
      [". and ,", "the next and the previous point"], ["Shift and arrows", "move the cross; with Select, the point it is at"], ["Enter", "use the tool where the cross is"], ["+ − 0", "zoom in, out, fit"],
      ["Q", "the next view: plain, names, free motions"], ["N P L M S H O I", "names, points, traces, free motions, velocities, grid, ghosts, information"],
      ["W", "full screen"], ["C Shift-C", "copy the picture as PNG, as SVG"], ["Shift-S", "save what is on show as PNG"],
      ["K", "record what is done by hand; again: save it as a film"], ["X", "clear the sheet"], ["Delete", "remove what is selected"],
      ["Ctrl-space", "in the script: what may be written here"], ["F1 F2 Shift-Alt-F", "in the script: what a name is, rename, format"],
      ["Handle at a number", "drag it: the number changes"], ["Escape", "let go; in the script: back to the picture"],
      ["Ctrl-S Ctrl-O", "save, open"], ["Ctrl-Z Ctrl-Y", "undo, redo"], ["Ctrl-E", "to the script"]];
    this.sheet("Keys", [make("dl", {}, ...rows.flatMap(([key, words]) => [make("dt", {text: key}), make("dd", {text: words})]))]);
  }
}
