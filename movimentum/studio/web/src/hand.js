/* Dragging: what is free follows by way of the server, what no statement holds is put elsewhere in the script, what is
   driven moves the time, what is fixed says why. */
export class Hand {
  constructor(app) {
    this.app = app;
    this.count = 0;
    this.current = null;
    this.times = [];
  }

  grab(hit, at) {
    const {app} = this;
    this.count += 1;
    const grip = {number: this.count, hit, at, state: "asked", wanted: null, waiting: false, moves: 0, done: false};
    grip.local = app.stage.localPoint(hit.thing, hit.at || at);
    this.current = grip;
    app.send({kind: "grab", rev: app.shownRev, grip: grip.number, thing: hit.thing, anchor: hit.anchor || "", at: hit.at || at, time: app.clock.time});
    return grip;
  }

  grabbed({grip: number, state, words}) {
    const grip = this.current;
    if (!grip || grip.number !== number) return;
    grip.state = state;
    grip.words = words;
    if (state === "fixed" && this.app.pointer.driven(grip.hit, grip.local)) grip.state = "driven";
    if (grip.wanted) this.move(grip, grip.wanted);
    if (grip.dropped) this.put(grip);
  }

  move(grip, at) {
    grip.wanted = at;
    if (grip.state === "free") this.pull(grip);
    else if (grip.state === "loose") this.carry(grip, at);
    else if (grip.state === "driven") this.scrub(grip, at);
    else if (grip.state === "fixed") this.refuse(grip);
    else if (grip.state === "late") this.app.hint(grip.words);
  }

  /* What no statement holds, and everything else that is selected with it: at once, and in the script when it is let go. */
  carry(grip, at) {
    const {app} = this, {stage} = app;
    const chosen = app.selection.map(({thing}) => thing);
    const things = chosen.includes(grip.hit.thing) && chosen.length > 1 ? chosen : [grip.hit.thing];
    grip.names = [...new Set(things)].map((number) => stage.scene.things[number].name);
    const begin = grip.begin || (grip.begin = grip.hit.at || grip.at), place = grip.hit.at || grip.at;
    const wanted = [place[0] + at[0] - grip.at[0], place[1] + at[1] - grip.at[1]];
    const end = app.pointer.snap.place(wanted, null, grip.names);
    grip.to = end.at.map((value, axis) => (end.exact || stage.grid ? value : Math.round(wanted[axis] - begin[axis]) + begin[axis]));
    stage.guides = end.guides;
    stage.shift = {things: new Set(things), by: [grip.to[0] - begin[0], grip.to[1] - begin[1]]};
    stage.draw();
    app.faces.show();
  }

  /* Its coordinates become where it was left. */
  put(grip) {
    const {app} = this;
    app.stage.guides = [];
    if (grip.state !== "loose" || !grip.to) return;
    if (Math.hypot(grip.to[0] - grip.begin[0], grip.to[1] - grip.begin[1]) < 1e-3) { app.stage.shift = null; return; }
    app.guide.hasDragged();
    app.useTool("move", grip.names, [grip.begin, grip.to]);
    app.hint(`${grip.names.map((name) => `\`${name}\``).join(", ")}: moved in the script, as no statement holds it.`);
  }

  /* The hand is taken away before its time. */
  give(grip) {
    grip.done = true;
    if (this.app.stage.shift && !grip.dropped) { this.app.stage.shift = null; this.app.stage.draw(); }
  }

  /* Only one move is under way at a time: the newest place goes next. */
  pull(grip) {
    if (grip.waiting || !grip.wanted) return;
    grip.waiting = true;
    grip.moves += 1;
    this.app.send({kind: "move", grip: grip.number, move: grip.moves, to: grip.wanted});
    if (grip.target !== grip.wanted) grip.off = Infinity;
    grip.target = grip.wanted;
    grip.wanted = null;
  }

  moved({grip: number, ms, places, marks}) {
    const grip = this.current;
    this.times.push(ms);
    if (!grip || grip.number !== number) return;
    grip.waiting = false;
    this.app.stage.hold(Float64Array.from(places), marks);
    this.app.stage.draw();
    this.app.guide.hasDragged();
    this.app.faces.show();
    if (!grip.wanted && !grip.done && this.nearer(grip)) grip.wanted = grip.target;
    if (grip.wanted) this.pull(grip);
  }

  /* A move takes a few steps only: what is still coming nearer is pulled on. */
  nearer(grip) {
    const {stage} = this.app;
    const [x, y] = stage.picture.place(grip.hit.thing, grip.local, stage.picture.frame);
    const off = Math.hypot(x - grip.target[0], y - grip.target[1]);
    const before = grip.off;
    grip.off = off;
    return off > 0.05 && off < 0.98 * before;
  }

  scrub(grip, at) {
    const {stage, clock} = this.app;
    grip.path = grip.path || stage.path(grip.hit.thing, grip.local);
    let best = clock.frame, least = Infinity;
    const size = Math.max(1, stage.rect[2] - stage.rect[0]);
    grip.path.forEach(([x, y], frame) => {
      const apart = Math.abs(frame - clock.frame);
      const away = Math.hypot(x - at[0], y - at[1]) + 0.02 * size * Math.min(apart, clock.frames - apart) / clock.frames;
      if (away < least) { least = away; best = frame; }
    });
    if (best !== clock.frame) clock.seek(best);
  }

  refuse(grip) {
    if (grip.told) return;
    grip.told = true;
    this.app.tellWhy(grip.hit.name, grip.words);
  }

  drop(grip, at, dragged) {
    if (!dragged) return;
    this.move(grip, at);
    grip.dropped = true;
    this.put(grip);
  }

  /* The definitions say the pose on show from now on. */
  keep() {
    const {app} = this;
    app.useTool("pose", [], []);
  }

  /* What a move that is still under way answers is not shown any more. */
  leave() {
    const {app} = this;
    this.current = null;
    if (!app.stage.held) return false;
    app.stage.hold(null, null);
    app.faces.show();
    app.send({kind: "leave", rev: app.shownRev});
    app.stage.draw();
    return true;
  }
}
