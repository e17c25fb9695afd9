/* For who does not see the picture: every part, where its points are, and whether it moves. */
import {byId, make} from "./dom.js";

const MOST = 200, PAUSE = 300;

export class Spoken {
  constructor(app) {
    this.app = app;
  }

  /* When nothing has changed for a moment. */
  soon() {
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => this.tell(), PAUSE);
  }

  tell() {
    const {stage, clock} = this.app, place = byId("spoken");
    if (clock.playing) return;
    const anchors = stage.anchors();
    const things = stage.scene && stage.picture ? stage.scene.things : [];
    const rows = things.map((thing, number) => ({thing, number})).filter(({thing}) => !thing.hidden).slice(0, MOST).map(({thing, number}) => {
      const where = anchors.filter((item) => item.thing === number).map(({anchor, at: [x, y]}) => `${anchor} at ${Math.round(x)}, ${Math.round(y)}`);
      const state = stage.free.things.includes(number) ? "free" : stage.moves(number) ? "moves" : "still";
      return make("li", {text: `${thing.name}, ${thing.shape}, ${state}${where.length ? `: ${where.join("; ")}` : ""}`});
    });
    place.replaceChildren(...rows);
  }
}
