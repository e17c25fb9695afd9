/* Each state of the page has its own face: empty, broken, solving, stopped, stale, offline, and a pose that is only a hand's. */
import {byId, button, glyph, make} from "./dom.js";
import {inline} from "./panel.js";

const LATE = 700; // ms after which solving is told

export class Faces {
  constructor(app) {
    this.app = app;
    this.stopped = false;
    this.late = false;
    this.shown = "";
  }

  /* Another text is on its way. */
  begin() {
    this.stopped = false;
    this.late = false;
    this.begun = performance.now();
    clearTimeout(this.waiting);
    clearTimeout(this.paling);
    this.waiting = setTimeout(() => { this.late = true; this.show(); }, LATE);
    this.paling = setTimeout(() => this.show(), 200);
    this.show();
  }

  /* It has its picture, or it is known that it has none. */
  end() {
    clearTimeout(this.waiting);
    this.late = false;
    this.show();
  }

  stop() {
    const {app} = this;
    app.send({kind: "stop", rev: app.rev});
    this.stopped = true;
    this.end();
    app.hint("Stopped. Your next edit is solved again.");
  }

  get solving() {
    const {app} = this;
    return !this.stopped && app.link.ready && !app.finished && (app.rev !== app.shownRev || app.stage.glimpse);
  }

  get broken() {
    const {app} = this;
    return app.settled && app.rev !== app.shownRev && app.diagnostics.some(({severity}) => severity === "error");
  }

  get face() {
    const {app} = this;
    if (!app.link.ready) return app.begun ? "offline" : "";
    if (this.stopped) return "stopped";
    if (this.broken) return "broken";
    if (this.solving) return performance.now() - this.begun > 190 && app.stage.picture ? (this.late ? "solving" : "stale") : this.late ? "solving" : "";
    return app.editor.text.trim() ? "" : "empty";
  }

  /* Only a hand has made the pose on show. */
  get temporary() {
    return this.app.stage.held !== null || this.app.stage.shift !== null;
  }

  show() {
    const {app} = this, {face} = this, room = byId("room");
    room.dataset.face = face === "solving" ? "stale" : face;
    room.dataset.temporary = String(this.temporary);
    app.stage.canvas.classList.toggle("stale", ["stale", "solving", "stopped"].includes(face));
    this.showBusy(face);
    this.showCard(face);
    this.showHanded();
  }

  showBusy(face) {
    const place = byId("busy"), halted = byId("halted"), {app} = this, busy = face === "solving";
    if (halted.hidden === (face === "stopped")) {
      halted.hidden = face !== "stopped";
      halted.replaceChildren(glyph("stop"), make("span", {text: "Stopped"}));
      button(halted, "solve", "Solve", "Solve it after all", () => app.submit(), {class: "main"});
    }
    if (place.hidden !== busy) return;
    place.hidden = !busy;
    clearInterval(this.counting);
    if (busy) {
      const words = make("span", {text: "solving …"});
      const count = () => { words.textContent = `solving … ${Math.round((performance.now() - this.begun) / 1000)} s`; };
      this.counting = setInterval(count, 1000);
      place.replaceChildren(make("progress", {"aria-label": "Solving"}), words);
      button(place, "stop", "Stop", "Give it up", () => this.stop(), {icon: "stop"});
    }
  }

  /* In the middle of the sheet: what there is to see, or why there is nothing. */
  showCard(face) {
    const {app} = this, place = byId("face");
    const error = face === "broken" ? app.diagnostics.find(({severity}) => severity === "error") : null;
    const blank = !app.stage.picture;
    const key = !blank || !["broken", "empty", "offline"].includes(face) || (face === "empty" && (app.guide.on || app.pointer.corners.length)) ? "" : `${face} ${error ? `${error.line} ${error.message}` : ""}`;
    place.hidden = !key;
    if (place.dataset.key === key) return;
    place.dataset.key = key;
    place.dataset.face = face;
    place.classList.toggle("plain", face === "empty");
    if (!key) return;
    if (face === "broken") {
      const count = app.diagnostics.filter(({severity}) => severity === "error").length;
      place.replaceChildren(glyph("wrong"), make("h2", {text: count > 1 ? `${count} errors: there is no picture yet` : "An error: there is no picture yet"}), make("p", {}, ...inline(error.message)));
      if (error.line !== null) button(place, "face-go", `Go to line ${error.line}`, "Go to the error", () => app.goTo(error), {class: "main"});
    } else if (face === "empty") {
      place.replaceChildren(glyph("rod"), make("h2", {text: "A blank sheet"}), make("p", {text: "Draw with the tools, or type."}));
    } else {
      place.replaceChildren(glyph("offline"), make("h2", {text: "No connection"}), make("p", {text: "What you type is kept here. Start movimentum studio again on the same port."}));
    }
  }

  showHanded() {
    const {app} = this, place = byId("handed"), on = app.stage.held !== null && !app.stage.shift;
    if (place.hidden === !on) return;
    place.hidden = !on;
    if (!on) { place.replaceChildren(); return; }
    place.replaceChildren(make("span", {text: "A pose by hand, not in the script"}));
    button(place, "keep-pose", "Keep this pose", "Write this pose into the definitions (Y)", () => app.hand.keep(), {class: "main"});
    button(place, "leave-pose", "Back", "Back to the script's pose (Escape)", () => app.hand.leave(), {icon: "undo"});
  }

  connection(on) {
    const place = byId("link");
    place.dataset.on = String(on);
    place.replaceChildren(...(on ? [] : [glyph("offline"), make("span", {text: "no connection: what you type is kept here"})]));
    this.show();
  }
}
