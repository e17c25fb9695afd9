/* What is done by hand as a film: every picture that is shown, with its time. */
import {face, make} from "./dom.js";

export class Record {
  constructor(app) {
    this.app = app;
    this.on = false;
    this.count = 0;
    app.stage.shown = () => this.shoot();
  }

  toggle() {
    if (this.on) this.end(); else this.begin();
  }

  begin() {
    const {app} = this;
    if (!app.send({kind: "record", rev: app.shownRev})) { app.hint("There is no connection."); return; }
    this.on = true;
    this.count = 0;
    this.begun = performance.now();
    this.last = "";
    this.show();
    app.hint("Recording: what you drag, play or draw becomes a film. Press Record (K) again to end it.");
    this.shoot();
  }

  get at() {
    return performance.now() - this.begun;
  }

  shoot() {
    const {app} = this, {stage, clock} = app;
    if (!this.on || !stage.picture || stage.glimpse) return;
    const held = stage.held !== null;
    const key = `${app.shownRev} ${clock.frame} ${held ? app.hand.times.length : ""}`;
    if (key === this.last) return;
    this.last = key;
    if (app.send({kind: "shot", rev: app.shownRev, at: this.at, time: clock.time, held})) this.count += 1;
    this.show();
  }

  show() {
    this.button.setAttribute("aria-pressed", String(this.on));
    face(this.button, this.on ? "stop" : "record", this.on ? String(this.count) : "");
  }

  end() {
    const {app} = this, until = this.at;
    this.on = false;
    this.show();
    if (this.count < 2) { app.hint("Nothing was recorded: drag something or play while recording."); return; }
    const formats = app.files.formats.filter((each) => ![".png", ".jpg"].includes(each));
    const chosen = make("select", {"aria-label": "Format", "data-testid": "record-format"}, ...formats.map((each) => make("option", {value: each, text: each.slice(1)})));
    const [row, input] = app.files.field("File", {value: `${app.files.stem()}-by-hand.gif`, required: true, "data-testid": "record-name"});
    chosen.addEventListener("change", () => { input.value = input.value.replace(/(\.[^.]*)?$/, chosen.value); });
    app.files.dialog("Save the recording", [
      make("p", {text: `${this.count} pictures in ${(until / 1000).toFixed(1)} s. Pauses are cut to one second.`}),
      make("label", {}, make("span", {text: "Format"}), chosen), row,
    ], (place) => {
      place.close();
      const name = input.value.trim();
      app.files.renders(name, (job) => ({kind: "recorded", job, name, scale: 1, at: until}));
    }, "Save");
  }
}
