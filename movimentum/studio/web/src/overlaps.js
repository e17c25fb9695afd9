/* Which parts overlap: a red outline while they do, a mark on the scrubber, and a button for each that goes there. */
import {byId, make} from "./dom.js";

const MOST = 60; // buttons
const number = (value) => String(Number(value.toFixed(3)));

export class Overlaps {
  constructor(app) {
    this.app = app;
    this.on = false;
    this.found = [];
    this.known = false; // whether they are those of the text as it is
  }

  show(on) {
    this.on = on;
    this.app.send({kind: "overlaps", wanted: on});
    this.keep(on ? null : []);
  }

  /* There is a server again, or another one. */
  connected() {
    if (this.on) this.app.send({kind: "overlaps", wanted: true});
  }

  told({rev, overlaps}) {
    if (rev === this.app.rev && this.on) this.keep(overlaps);
  }

  /* Another text: what was found may not hold any more. */
  doubt() {
    this.known = false;
    byId("overlaps").classList.add("stale");
  }

  /* null: they are being looked for. */
  keep(found) {
    const {app} = this, place = byId("overlaps");
    this.found = found || [];
    this.known = found !== null;
    place.hidden = !this.on;
    place.classList.remove("stale");
    const words = found === null ? "Looking for overlaps …" : found.length ? "" : "Nothing overlaps.";
    place.replaceChildren(...(words ? [make("span", {class: "calm", text: words})] : this.found.slice(0, MOST).map((item, k) => make("button", {
      type: "button", class: "claim fails", "data-testid": `overlap-${k}`, title: "Go to where they are deepest.",
      text: `${item.words}, t = ${number(item.from)} to ${number(item.to)}`, onclick: () => this.go(item),
    }))));
    if (this.found.length > MOST) place.append(make("span", {class: "calm", text: `and ${this.found.length - MOST} more`}));
    app.clock.overlapping(this.found.map((item) => [item.from, item.to]));
    app.stage.draw();
  }

  go({deepest, things}) {
    const {app} = this, {clock} = app;
    if (!this.known) return;
    clock.pause();
    clock.seek((deepest - clock.start) * clock.fps);
    if (app.spansRev === app.rev) app.choose(things.map((thing) => ({thing, anchor: null, name: app.stage.scene.things[thing].name, at: null})));
  }

  /* The numbers of the things that overlap at the time on show; what overlaps between two frames shows at the nearer. */
  now() {
    if (!this.known) return new Set();
    const {time, fps} = this.app.clock, half = 0.5 / fps;
    return new Set(this.found.filter(({from, to}) => from - half <= time && time <= to + half).flatMap(({things}) => things));
  }
}
