/* The studio: script and motion as two views of one thing. */
import {Places} from "./places.js";
import {Link} from "./link.js";
import {Assist} from "./assist.js";
import {Editor} from "./editor.js";
import {Stage} from "./stage.js";
import {Clock} from "./clock.js";
import {Pointer} from "./pointer.js";
import {Hand} from "./hand.js";
import {showProblems} from "./problems.js";
import {FileWork} from "./files.js";
import {Controls} from "./controls.js";
import {Velocities} from "./velocity.js";
import {Claims} from "./claims.js";
import {Overlaps} from "./overlaps.js";
import {Traces} from "./traces.js";
import {Copies} from "./copies.js";
import {Cross} from "./cross.js";
import {Record} from "./record.js";
import {Start} from "./start.js";
import {Guide} from "./guide.js";
import {Panel, inline} from "./panel.js";
import {Faces} from "./faces.js";
import {Context} from "./context.js";
import {Forms} from "./forms.js";
import {Plots} from "./plots.js";
import {Drop} from "./drop.js";
import {Spoken} from "./spoken.js";
import {Steps} from "./steps.js";
import {splitter} from "./layout.js";
import {byId} from "./dom.js";

class App {
  constructor() {
    this.rev = 0;
    this.shownRev = 0;
    this.diagnostics = [];
    this.settled = false;
    this.keys = new Map();
    this.keyMs = [];
    this.begun = false;
    this.pressed = 0;
    this.finished = false;
    this.selection = []; // [{thing, anchor, name, at}], what is selected last comes last
    this.stage = new Stage(byId("stage"));
    this.clock = new Clock(byId("player"), {shown: (frame) => { this.stage.seek(frame); this.plots.draw(); this.claims.mark(); this.faces.show(); }, settled: () => { this.look(); this.spoken.soon(); }});
    this.steps = new Steps(this);
    this.faces = new Faces(this);
    this.assist = new Assist(this);
    this.editor = new Editor(byId("editor"), {changed: (update) => this.changed(update), moved: () => this.cursorMoved(), extensions: this.assist.extensions});
    this.velocities = new Velocities(this);
    this.claims = new Claims(this);
    this.overlaps = new Overlaps(this);
    this.traces = new Traces(this);
    this.copies = new Copies(this);
    this.stage.under.push((context, px) => this.traces.draw(context, px), (context, px) => this.velocities.draw(context, px));
    this.stage.colored = () => this.claims.colors();
    this.stage.overlapping = () => this.overlaps.now();
    this.record = new Record(this);
    this.start = new Start(this);
    this.guide = new Guide(this);
    this.playNext = false;
    this.hand = new Hand(this);
    this.pointer = new Pointer(this);
    this.panel = new Panel(this);
    this.context = new Context(this);
    this.forms = new Forms(this);
    this.plots = new Plots(this);
    this.drop = new Drop(this);
    this.spoken = new Spoken(this);
    splitter();
    this.cross = new Cross(this);
    this.files = new FileWork(this);
    this.controls = new Controls(this);
    window.addEventListener("keydown", () => { this.pressed = performance.now(); }, true);
    const url = new URL("socket", window.location.href);
    url.protocol = "ws:";
    url.search = window.location.search;
    this.link = new Link(url, {message: (message) => this.receive(message), state: (on) => this.connection(on)});
  }

  send(message) {
    return this.link.send(message);
  }

  hint(words) {
    byId("hint").replaceChildren(...inline(words || ""));
  }

  connection(on) {
    this.begun = this.begun || on;
    this.faces.connection(on);
    if (on) this.overlaps.connected(); else this.assist.forget();
  }

  /* --- the text --- */

  changed(update) {
    this.rev += 1;
    const now = performance.now();
    const byKey = update.transactions.some((each) => each.isUserEvent("input") || each.isUserEvent("delete") || each.isUserEvent("undo"));
    if (byKey) this.keys.set(this.rev, now - this.pressed < 1000 && this.pressed ? this.pressed : now);
    this.places = null;
    this.assist.forget();
    this.selection = []; // what it was may have another number now
    this.panel.select([]);
    this.steps.changed(update);
    this.files.changed();
    this.claims.doubt();
    this.overlaps.doubt();
    this.settled = false;
    this.submit();
  }

  submit() {
    this.finished = false;
    this.send({kind: "text", rev: this.rev, text: this.editor.text, time: this.clock.time});
    this.faces.begin();
  }

  get offsets() {
    this.places = this.places || new Places(this.editor.text);
    return this.places;
  }

  /* --- what the server says --- */

  receive(message) {
    const {kind} = message;
    const act = {
      welcome: () => this.files.welcome(message),
      stage: () => this.stageDone(message),
      film: () => this.filmShown(message),
      same: () => this.pictureKept(message),
      free: () => this.motionsFree(message),
      grabbed: () => this.hand.grabbed(message),
      moved: () => this.hand.moved(message),
      proposals: () => this.assist.told(message),
      explained: () => this.assist.told(message),
      named: () => this.assist.told(message),
      meant: () => this.assist.told(message),
      edits: () => { if (!this.assist.told(message)) this.edited(message); },
      answer: () => this.panel.answer(message),
      plotted: () => this.plots.told(message),
      stored: () => this.drop.stored(message),
      claims: () => this.claims.told(message),
      overlapped: () => this.overlaps.told(message),
      speeds: () => this.velocities.told(message),
      thumbnail: () => this.start.thumbnail(message),
      listed: () => { if (this.files.listed) this.files.listed(message); },
      svg: () => this.copies.told(message),
      disk: () => this.files.diskChanged(message),
      saved: () => this.files.saveDone(message),
      opened: () => this.files.opened(message),
      progress: () => this.files.renderAdvanced(message),
      told: () => this.hint(message.words),
    }[kind];
    if (act) act();
  }

  stageDone({rev, stage, diagnostics, final, understood}) {
    if (rev !== this.rev) return;
    if (stage === "read" && !final) {
      this.settled = false;
      const kept = this.diagnostics.filter((item) => item.severity !== "error");
      if (kept.length === this.diagnostics.length) return; // what was said holds until more is known
      this.diagnostics = kept;
    } else {
      const {offsets} = this;
      const rank = {error: 0, warning: 1, note: 2};
      this.diagnostics = diagnostics
        .map((item) => ({...item, at: item.from === null ? null : offsets.span([item.from, item.to])}))
        .sort((a, b) => rank[a.severity] - rank[b.severity]); // the worst first, and its fixes
      this.settled = true;
    }
    if (final) this.finished = true;
    if (final && !understood && !this.editor.text.trim()) {
      this.stage.clear();
      this.clock.film({frames: 1, fps: 24, start: 0, steps: []});
      this.shownRev = rev;
    }
    if (final && (!understood || stage === "path")) this.keys.delete(rev);
    this.showDiagnostics();
    if (final || this.faces.broken) this.faces.end();
    if (final && (!understood || stage === "path")) {
      this.claims.forget();
      if (this.overlaps.on) this.overlaps.keep([]);
    }
  }

  showDiagnostics() {
    this.editor.squiggle(this.diagnostics.map((item) => ({...item, from: item.at ? item.at[0] : null, to: item.at ? item.at[1] : null})));
    const blank = !this.editor.text.trim(); // a blank sheet is no mistake
    showProblems(byId("problems"), blank ? [] : this.diagnostics, {
      settled: this.settled,
      calm: blank ? "Draw with the tools, or type." : "Everything is determined and agrees.",
      poses: () => this.panel.ask("solutions", ""),
      mean: (code) => this.assist.mean(code),
      go: (item) => this.goTo(item),
      fix: (fix) => this.editor.apply(fix.edits.map((edit) => ({from: this.offsets.unit(edit.from), to: this.offsets.unit(edit.to), text: edit.text}))),
    });
  }

  goTo(item) {
    if (item.from === null) return;
    this.editor.select(this.offsets.span([item.from, item.to]));
    this.editor.focus();
  }

  filmShown({rev, glimpse, scene, film}) {
    if (rev < this.shownRev) return;
    this.useScene(rev, scene);
    this.stage.frame = this.clock.frame;
    this.stage.show(film, scene, glimpse);
    if (!glimpse) this.velocities.forget();
    this.traces.forget();
    if (!glimpse && scene.all > scene.most) this.hint(`The film has ${scene.all} frames; the first ${scene.frames} are shown.`);
    this.pictured(rev);
    if (!glimpse && rev === this.rev) this.faces.end();
    this.spoken.soon();
    this.guide.show();
    if (!glimpse && this.plots.curves.length) this.plots.ask();
    if (this.playNext && !glimpse && rev === this.rev && scene.frames > 1) {
      this.playNext = false;
      this.clock.play();
    }
  }

  pictureKept({rev, scene}) {
    if (rev < this.shownRev) return;
    if (scene === null) { this.pictured(rev, true); return; }
    this.useScene(rev, scene);
    this.stage.draw();
    this.pictured(rev);
    if (rev === this.rev) this.faces.end();
  }

  /* Steps, statements and things of the text that is shown. */
  useScene(rev, scene) {
    this.clock.film(scene);
    if (rev === this.rev) {
      const {offsets} = this;
      scene.things.forEach((thing) => { thing.range = thing.span ? offsets.span(thing.span) : null; thing.places = thing.uses.map((span) => offsets.span(span)); });
      scene.statements.forEach((item) => { item.range = offsets.span(item.span); });
      scene.constants.forEach((item) => { item.range = item.span ? offsets.span(item.span) : null; });
      this.spansRev = rev;
    }
    this.stage.scene = scene;
    this.controls.constants(rev === this.rev ? scene.constants : null);
  }

  pictured(rev, early = false) {
    this.shownRev = rev;
    for (const [number, begun] of [...this.keys]) {
      if (number > rev) continue;
      if (number === rev) this.keyMs.push(performance.now() - begun);
      this.keys.delete(number);
    }
    this.faces.show();
    if (!early) this.stage.lit = new Set();
  }

  /* What is free at the time on show? */
  look() {
    if (this.stage.picture && !this.stage.glimpse && !this.clock.playing) {
      this.send({kind: "look", rev: this.shownRev, time: this.clock.time});
    }
  }

  motionsFree({rev, time, motions, things}) {
    if (rev !== this.shownRev || Math.abs(time - this.clock.time) > 1e-9) return;
    this.stage.free = {motions, things};
    this.panel.freedom(motions);
    this.stage.draw();
  }

  /* --- picture and text --- */

  /* `more`: beside what is selected already, or not any more. */
  selectThing(hit, more = false) {
    const {stage} = this;
    if (more && hit) {
      const there = this.selection.some(({thing}) => thing === hit.thing);
      this.choose(there ? this.selection.filter(({thing}) => thing !== hit.thing) : [...this.selection, hit]);
    } else if (!more) this.choose(hit && stage.scene.things[hit.thing] && this.spansRev === this.rev ? [hit] : []);
  }

  /* Everything whose points are all in a box. */
  selectBox([[x, y], [u, v]]) {
    const {stage} = this, within = ([a, b]) => a >= Math.min(x, u) && a <= Math.max(x, u) && b >= Math.min(y, v) && b <= Math.max(y, v);
    const anchors = stage.anchors();
    const found = (stage.scene ? stage.scene.things : []).map((thing, number) => ({thing: number, anchor: null, name: thing.name, at: null, of: anchors.filter((item) => item.thing === number)}))
      .filter(({thing, of}) => !stage.scene.things[thing].hidden && of.length && of.every(({at}) => within(at)));
    this.choose(found.map(({of, ...hit}) => hit));
  }

  choose(hits) {
    const {stage} = this, numbers = new Set(hits.map(({thing}) => thing));
    this.selection = hits;
    stage.lit = numbers;
    this.panel.select(hits);
    if (!hits.length || this.spansRev !== this.rev) { this.editor.mark([]); stage.draw(); return; }
    const about = stage.scene.statements.filter((item) => item.range && item.things.some((thing) => numbers.has(thing))).map((item) => [...item.range, "mov-about"]);
    const own = [...numbers].map((number) => stage.scene.things[number].range).filter(Boolean);
    const uses = [...numbers].flatMap((number) => stage.scene.things[number].places || []).map((range) => [...range, "mov-about"]);
    this.editor.mark([...about, ...uses, ...own.map((range) => [...range, "mov-thing"])]);
    if (own.length === 1) this.editor.select(own[0]);
    stage.draw();
  }

  deleteSelection() {
    const names = this.selection.map(({thing}) => this.stage.scene.things[thing].name);
    if (names.length) this.useTool("delete", names, []);
  }

  cursorMoved() {
    const {stage} = this, place = this.editor.cursor;
    if (!stage.scene || this.spansRev !== this.rev) return;
    const covers = (range) => range && range[0] <= place && place <= range[1];
    const lit = new Set();
    for (const item of stage.scene.statements) if (covers(item.range)) item.things.forEach((thing) => lit.add(thing));
    stage.scene.things.forEach((thing, number) => { if (covers(thing.range) || (thing.places || []).some(covers)) lit.add(number); });
    stage.lit = lit;
    this.editor.mark([]);
    stage.draw();
  }

  useTool(tool, names, points) {
    this.using = tool;
    this.send({kind: "tool", rev: this.rev, tool, names, points, time: this.clock.time});
  }

  edited({rev, edits, select, words}) {
    if (words) this.hint(words);
    if (!edits.length) { this.playNext = false; this.stage.shift = null; this.stage.draw(); this.faces.show(); }
    if (rev !== this.rev || !edits.length) return;
    const {offsets} = this;
    const changes = edits.map((edit) => ({from: offsets.unit(edit.from), to: offsets.unit(edit.to), text: edit.text}));
    this.steps.next = this.using ? `Tool: ${this.using}` : "";
    this.using = "";
    this.editor.apply(changes);
    if (select.length) this.editor.select(this.offsets.span(select));
  }

  tellWhy(name, words) {
    this.hint(`${name} cannot be moved. ${words}`);
  }

  state() {
    const anchors = Object.fromEntries(this.stage.anchors().map(({name, at}) => [name, at]));
    return {
      rev: this.rev,
      shownRev: this.shownRev,
      time: this.clock.time,
      frame: this.clock.frame,
      frames: this.clock.frames,
      playing: this.clock.playing,
      anchors,
      diagnostics: this.diagnostics,
      settled: this.settled,
      glimpse: this.stage.glimpse,
      dragMs: [...this.hand.times],
      keyMs: [...this.keyMs],
      completeMs: [...this.assist.times],
      free: this.stage.free.motions.map(({words, arrows}) => ({words, arrows})),
      lit: [...this.stage.lit].map((number) => this.stage.scene.things[number].name),
      overlaps: this.overlaps.found.map(({words, from, to}) => ({words, from, to})),
      claims: this.claims.found.map(({words, holds, time = null}) => ({words, holds, time})),
      velocities: Object.fromEntries(this.velocities.list().map(({name, velocity}) => [name, velocity])),
      recorded: this.record.on ? this.record.count : null,
      traces: this.traces.state(),
      temporary: this.faces.temporary,
      solving: this.faces.solving,
      stopped: this.faces.stopped,
      face: this.faces.face,
      selection: this.selection.map(({name}) => name),
      panel: this.panel.state(),
      ghosts: this.stage.ghostFrames(),
      labels: this.stage.labels || [],
      texts: this.stage.picture ? this.stage.picture.boxes : [],
      plot: this.plots.curves.map(({text, rows}) => ({text, known: rows !== null})),
      plotCursor: this.plots.cursor || null,
      zoom: this.stage.view().scale,
      saved: !this.files.dirty,
    };
  }

  toScreen(point) {
    return this.stage.toScreen(point);
  }
}

const app = new App();
window.movimentum = {
  state: () => app.state(),
  toScreen: (point) => app.toScreen(point),
  seek: (frame) => app.clock.seek(frame),
  text: () => app.editor.text,
  disconnect: () => app.link.socket.close(),
  cursor: () => app.editor.cursor,
  select: (from, to = from) => { app.editor.view.dispatch({selection: {anchor: from, head: to}}); app.editor.focus(); },
  selected: () => app.editor.selected,
  scroll: (top = null) => app.editor.scroll(top),
};

