/* A living figure: constants are sliders, the drive is a handle, and everything is computed here. No request.
 *
 *   const figure = new MovimentumFigure(element, film, MOVIMENTUM_LIVE);   // as a MovimentumPlayer, and
 *   figure.set({R: 60});       // constants
 *   figure.at(0.25);           // the time
 *   figure.anchorsAt(0.25);    // {"Rod.B": [x, y]}, null where it cannot be assembled
 *   figure.state();            // {…, constants, solved, gaps: [[from, to]], bounds: {R: [[least, most]]}, dragMs}
 *
 * A number of the film that changes is {"live": k}: it is replaced, before each drawing, by number k of the picture.
 * `living/follow.py` does what `begun` and `follow` do here.
 */
"use strict";

const HOPS = 8, MOST_SIGNS = 6, BETWEEN = 4, SAMPLES = 48;

class MovimentumFigure extends MovimentumPlayer {
  constructor(element, film, code, keys = document) {
    const calm = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    super(element, film, keys);
    this.code = code;
    this.live = film.live;
    this.constants = this.defaults();
    this.instant = null;
    this.dragMs = [];
    this.bounds = {};
    this.holes = [];
    this.hulls = [];
    this.grown = [];
    this.find(film);
    this.wrap();
    this.panel(element);
    this.follow();
    this.boundsLater();
    this.begins = true;
    this.draw();
    if (calm) this.pause();
  }

  defaults() {
    return Object.fromEntries(this.live.sliders.map((slider) => [slider.code, slider.value]));
  }

  /* Where live numbers stand in the film. */
  find(value) {
    if (value === null || typeof value !== "object" || value === this.live) return;
    if (value.form === "hull") this.hulls.push([value, value.rings[0]]);
    if (value.scale !== undefined && value.rings) this.grown.push([value, value.rings]);
    for (const [key, inner] of Object.entries(value)) {
      if (inner !== null && typeof inner === "object" && "live" in inner && Object.keys(inner).length === 1) {
        this.holes.push([value, key, inner.live]);
        value[key] = 0;
      } else {
        this.find(inner);
      }
    }
  }

  /* --- the motion --- */

  stage(time) {
    let found = 0;
    this.live.stages.forEach((stage, k) => { if (stage.start <= time + 1e-9) found = k; });
    return found;
  }

  run(stage, time, constants, memory) {
    return this.code.stages[stage](time, constants, memory);
  }

  /* The least of what is negative where a step cannot be assembled. */
  good(stage, values) {
    const {margins, choices, checks} = this.live.stages[stage], {low, off, size} = this.live;
    const end = values.length, from = end - checks - choices - margins;
    for (let k = 0; k < end; k += 1) {
      const value = values[k];
      if (!Number.isFinite(value)) return false;
      if (k < from) continue;
      if (k < from + margins ? value < -low : k < end - checks ? value < -off * size : Math.abs(value) > off * size) return false;
    }
    return true;
  }

  begun(stage, constants) {
    const one = this.live.stages[stage], defaults = this.defaults();
    let memory = {};
    for (let hop = 0; one.follows && hop < HOPS; hop += 1) {
      const way = {}, next = {...memory};
      for (const name of Object.keys(defaults)) way[name] = defaults[name] + (constants[name] - defaults[name]) * hop / HOPS;
      if (this.good(stage, this.run(stage, one.start, way, next))) memory = next;
    }
    const signs = one.signs.slice(0, MOST_SIGNS);
    if (one.choices === 0) return memory;
    const ways = Array.from({length: 2 ** signs.length}, (_, way) => way);
    const flipped = (way) => way.toString(2).replaceAll("0", "").length;
    for (const way of ways.sort((a, b) => flipped(a) - flipped(b) || a - b)) {
      const tried = {...memory};
      signs.forEach((name, k) => { tried[name] = (way >> (signs.length - 1 - k)) & 1 ? -1 : 1; });
      if (this.good(stage, this.run(stage, one.start, constants, {...tried}))) return tried;
    }
    return memory;
  }

  /* Rows {time, values, memory} at the frames and ``between`` of them; values are null where there are none. */
  rows_(constants, between, every = true) {
    const {times} = this.film, rows = [];
    const marks = [...times];
    if (this.live.loops || times.length < 2) marks.push(this.live.end);
    let now = -1, memory = {};
    for (let k = 0; k < marks.length; k += 1) {
      const parts = k + 1 < marks.length ? between : 1;
      for (let part = 0; part < parts; part += 1) {
        const time = part ? marks[k] + (marks[k + 1] - marks[k]) * part / parts : marks[k];
        const inside = time >= this.live.end && this.live.stages.length > 1 ? Math.max(0, now) : this.stage(time);
        if (inside !== now) { now = inside; memory = this.begun(now, constants); }
        const next = this.live.stages[now].follows ? {...memory} : memory;
        const values = this.run(now, time, constants, next), good = this.good(now, values);
        if (good) memory = next; else if (!every) return null;
        rows.push({time, stage: now, values: good ? values : null, memory});
      }
    }
    return rows;
  }

  follow() {
    this.track = this.rows_(this.constants, BETWEEN);
    this.measured = [];
    for (const row of this.track) {
      if (!row.values) continue;
      this.code.measures(row.values, {}, [], this.constants, row.time).forEach((value, k) => {
        this.measured[2 * k] = Math.min(this.measured[2 * k] ?? Infinity, value);
        this.measured[2 * k + 1] = Math.max(this.measured[2 * k + 1] ?? -Infinity, value);
      });
    }
    this.gaps = this.missing(this.track, this.constants);
    this.tell();
  }

  /* The outputs at any time, followed from the row before; null where there are none. */
  outputs(time) {
    const rows = this.track;
    let low = 0, high = rows.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (rows[middle].time <= time + 1e-12) low = middle; else high = middle - 1;
    }
    if (Math.abs(rows[low].time - time) < 1e-12) return rows[low].values;
    const {stage, memory} = rows[low], values = this.run(stage, time, this.constants, {...memory});
    return this.good(stage, values) ? values : null;
  }

  /* --- where it cannot be assembled --- */

  /* The least margin at a time, and what it is with. */
  margin(stage, time, constants, memory) {
    const values = this.run(stage, time, constants, {...memory}), one = this.live.stages[stage];
    const end = values.length - one.checks - one.choices;
    let least = Infinity;
    for (let k = end - one.margins; k < end; k += 1) least = Math.min(least, Number.isFinite(values[k]) ? values[k] : -1);
    return least;
  }

  /* Intervals of time in which there are no poses, to the edge; one between rows, too. */
  missing(rows, constants) {
    const gaps = [];
    const edge = (bad, good, row) => {
      const {stage, memory} = row;
      for (let k = 0; k < 40; k += 1) {
        const middle = (bad + good) / 2;
        if (this.good(stage, this.run(stage, middle, constants, {...memory}))) good = middle; else bad = middle;
      }
      return (bad + good) / 2;
    };
    for (let k = 0; k < rows.length; k += 1) {
      if (rows[k].values) continue;
      const from = k;
      while (k + 1 < rows.length && !rows[k + 1].values) k += 1;
      gaps.push([from ? edge(rows[from].time, rows[from - 1].time, rows[from - 1]) : rows[0].time,
                 k + 1 < rows.length ? edge(rows[k].time, rows[k + 1].time, rows[k + 1]) : rows[k].time]);
    }
    const touch = gaps.length ? null : this.dip(rows, constants);
    return touch === null ? gaps : [[touch, touch]];
  }

  /* A time between rows at which there is no pose, or null. */
  dip(rows, constants) {
    const least = rows.map((row) => {
      const one = this.live.stages[row.stage], end = row.values.length - one.checks - one.choices;
      let found = Infinity;
      for (let k = end - one.margins; k < end; k += 1) found = Math.min(found, row.values[k]);
      return found;
    });
    for (let k = 0; k < rows.length; k += 1) {
      const before = rows[Math.max(0, k - 1)], after = rows[Math.min(rows.length - 1, k + 1)];
      if (least[k] > 0.05 || least[k] > least[Math.max(0, k - 1)] || least[k] > least[Math.min(rows.length - 1, k + 1)]) continue;
      let low = before.stage === rows[k].stage ? before.time : rows[k].time;
      let high = after.stage === rows[k].stage ? after.time : rows[k].time;
      const at = (time) => this.margin(rows[k].stage, time, constants, rows[k].memory), golden = (Math.sqrt(5) - 1) / 2;
      let a = high - golden * (high - low), b = low + golden * (high - low), fa = at(a), fb = at(b);
      for (let pass = 0; pass < 30; pass += 1) {
        if (fa < fb) { high = b; b = a; fb = fa; a = high - golden * (high - low); fa = at(a); }
        else { low = a; a = b; fa = fb; b = low + golden * (high - low); fb = at(b); }
      }
      if (Math.min(fa, fb) < -this.live.low) return fa < fb ? a : b;
    }
    return null;
  }

  /* Whether the whole film can be assembled with a constant at a value. */
  fits(code, value) {
    const constants = {...this.constants, [code]: value}, rows = this.rows_(constants, 1, false);
    return rows !== null && this.dip(rows, constants) === null;
  }

  /* The intervals of a constant in which the whole film can be assembled. A generator: it pauses between samples. */
  *intervals(slider) {
    const {least, most, code} = slider, found = [];
    let before = null, open = null;
    const values = Array.from({length: SAMPLES + 1}, (_, k) => least + (most - least) * k / SAMPLES);
    const own = this.constants[code];
    if (own > least && own < most) { values.push(own); values.sort((a, b) => a - b); }
    for (const value of values) {
      yield;
      const fits = this.fits(code, value);
      if (before !== null && fits !== before.fits) {
        let a = before.value, b = value;
        for (let k = 0; k < 46 && Math.abs(b - a) > 1e-12 * Math.max(1, Math.abs(b)); k += 1) {
          const middle = (a + b) / 2;
          if (this.fits(code, middle) === before.fits) a = middle; else b = middle;
          if (k % 4 === 0) yield;
        }
        if (fits) open = b; else { found.push([open, a]); open = null; }
      } else if (before === null && fits) open = value;
      before = {value, fits};
    }
    if (open !== null) found.push([open, most]);
    return found;
  }

  boundsLater() {
    const turn = this.turn = (this.turn ?? 0) + 1, waiting = [...this.live.sliders];
    let now = null, slider = null;
    const work = () => {
      if (turn !== this.turn) return;
      const until = performance.now() + 6;
      while (performance.now() < until) {
        if (now === null) {
          slider = waiting.shift();
          if (!slider) return;
          now = this.intervals(slider);
        }
        const step = now.next();
        if (step.done) { this.showBounds(slider, step.value); now = null; }
      }
      setTimeout(work, 0);
    };
    setTimeout(work, 120);
  }

  showBounds(slider, intervals) {
    this.bounds[slider.code] = intervals;
    const {bar, told} = this.inputs[slider.code], {least, most} = slider;
    bar.replaceChildren(...intervals.map(([a, b]) => {
      const span = document.createElement("span");
      span.style.left = `${100 * (a - least) / (most - least)}%`;
      span.style.width = `${100 * (b - a) / (most - least)}%`;
      return span;
    }));
    const whole = intervals.length === 1 && intervals[0][0] <= least && intervals[0][1] >= most;
    const listed = intervals.map(([a, b]) => `${shortNumber(a)} to ${shortNumber(b)}`).join(", ");
    told.textContent = whole ? "" : intervals.length ? `can be assembled: ${listed}` : "cannot be assembled with these settings";
    bar.hidden = whole;
  }

  /* --- the page --- */

  wrap() {
    const box = document.createElement("div");
    box.className = "figure";
    this.canvas.replaceWith(box);
    box.append(this.canvas);
    this.box = box;
    if (!this.live.handle) return;
    const knob = this.knob = document.createElement("button"), {end} = this.live;
    const attributes = {type: "button", class: "handle", role: "slider", "data-testid": "handle", "aria-valuemin": this.film.times[0],
      "aria-valuemax": end, "aria-label": `Drive: ${this.live.handle.join(".")}`, title: "Drag it, or use the arrow keys"};
    for (const [name, value] of Object.entries(attributes)) knob.setAttribute(name, value);
    box.append(knob);
    knob.addEventListener("pointerdown", (event) => { this.pause(); knob.setPointerCapture(event.pointerId); event.preventDefault(); knob.focus(); });
    knob.addEventListener("pointermove", (event) => { if (knob.hasPointerCapture(event.pointerId)) this.drive(event); });
    knob.addEventListener("keydown", (event) => {
      const last = this.film.frames - 1, step = {ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10}[event.key];
      if (step) this.step(step);
      else if (event.key === "Home" || event.key === "End") { this.pause(); this.seek(event.key === "Home" ? 0 : last); }
      else return;
      event.preventDefault();
      event.stopPropagation();
    });
  }

  panel(element) {
    const make = (tag, attributes, parent) => {
      const made = document.createElement(tag);
      for (const [name, value] of Object.entries(attributes)) { if (name === "text") made.textContent = value; else made.setAttribute(name, value); }
      parent.append(made);
      return made;
    };
    this.status = make("div", {class: "status", role: "status", "data-testid": "status"}, element);
    const panel = make("div", {class: "sliders", role: "group", "aria-label": "Constants"}, element);
    this.inputs = {};
    const id = `movimentum-${MovimentumFigure.count = (MovimentumFigure.count ?? 0) + 1}`;
    for (const slider of this.live.sliders) {
      const {code, name, least, most, unit, value} = slider, own = `${id}-${code}`;
      make("label", {for: own, text: name}, panel);
      const about = {"aria-describedby": `${own}-bounds`};
      const step = 10 ** Math.floor(Math.log10((most - least) / 200));
      const range = make("input", {type: "range", id: own, min: least, max: most, step: "any", value, "data-testid": `slider-${name}`, ...about}, panel);
      const right = make("span", {}, panel);
      const number = make("input", {type: "number", min: least, max: most, step: "any", value, "aria-label": `${name}, as a number`, "data-testid": `number-${name}`}, right);
      if (unit) make("span", {class: "unit", text: unit}, right);
      const box = make("div", {class: "bounds"}, panel), bar = make("div", {class: "bar", "aria-hidden": "true"}, box);
      bar.hidden = true;
      const told = make("div", {class: "told", id: `${own}-bounds`, "data-testid": `bounds-${name}`}, box);
      this.inputs[code] = {range, number, bar, told};
      range.addEventListener("input", () => this.timed(() => this.set({[name]: Number(range.value)})));
      number.addEventListener("change", () => {
        const wanted = number.value.trim() === "" ? NaN : Number(number.value);
        this.set({[name]: Number.isFinite(wanted) ? Math.min(Math.max(wanted, least), most) : this.constants[code]});
      });
      range.addEventListener("keydown", (event) => {
        const way = {ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10}[event.key];
        if (!way) return;
        event.preventDefault();
        const next = Math.round((this.constants[code] + way * step) / step) * step;
        this.set({[name]: Math.min(Math.max(Number(next.toPrecision(12)), least), most)});
      });
    }
    const reset = make("button", {type: "button", text: "Reset", "data-testid": "reset", title: "All constants as in the script"}, element.querySelector(".controls"));
    reset.addEventListener("click", () => this.set(Object.fromEntries(this.live.sliders.map(({name, value}) => [name, value]))));
  }

  timed(act) {
    const begin = performance.now();
    act();
    this.dragMs.push(performance.now() - begin);
    if (this.dragMs.length > 1000) this.dragMs.shift();
  }

  set(values) {
    for (const {name, code} of this.live.sliders) if (name in values) this.constants[code] = values[name];
    for (const {code} of this.live.sliders) {
      const {range, number} = this.inputs[code], value = this.constants[code];
      if (Number(range.value) !== value) range.value = String(value);
      number.value = shortNumber(value);
      range.setAttribute("aria-valuetext", shortNumber(value));
    }
    this.follow();
    this.draw();
    this.boundsLater();
  }

  tell() {
    const broken = this.gaps.length > 0, begin = this.film.times[0], {end} = this.live;
    const all = this.track.every((row) => !row.values);
    const listed = this.gaps.map(([a, b]) => (a === b ? `at t = ${shortNumber(a)}` :
      a <= begin ? `until t = ${shortNumber(b)}` : b >= this.track.at(-1).time ? `from t = ${shortNumber(a)} on` : `from t = ${shortNumber(a)} to ${shortNumber(b)}`));
    this.status.textContent = !broken ? "" : all ? "Cannot be assembled with these settings." : `Cannot be assembled ${listed.join(", ")}.`;
    this.status.classList.toggle("broken", broken);
  }

  /* --- the drive --- */

  drive(event) {
    const point = this.toWorld([event.pageX, event.pageY]);
    this.timed(() => this.at(this.nearest(point)));
  }

  toWorld([px, py]) {
    const [a, b, c, d, e, f] = this.film.toImage, box = this.canvas.getBoundingClientRect(), scale = box.width / this.film.width;
    const u = (px - box.left - window.scrollX) / scale - e, v = (py - box.top - window.scrollY) / scale - f, det = a * d - b * c;
    return [(d * u - c * v) / det, (a * v - b * u) / det];
  }

  grip(values) {
    const body = this.film.bodies.findIndex((each) => each.name === this.live.handle[0]);
    return this.where(values, body, this.film.bodies[body].anchors[this.live.handle[1]]);
  }

  /* The time at which the handle is nearest to a point; of several, the one that is soonest from now. */
  nearest(point) {
    const rows = this.track.filter((row) => row.values), now = this.now(), whole = this.live.end - this.film.times[0];
    if (rows.length < 2) return now;
    const places = rows.map((row) => this.grip(row.values));
    const size = Math.max(...[0, 1].map((axis) => Math.max(...places.map((p) => p[axis])) - Math.min(...places.map((p) => p[axis])))) || 1;
    let best = Infinity, found = now;
    for (let k = 0; k + 1 < rows.length; k += 1) {
      const [ax, ay] = places[k], [bx, by] = places[k + 1], dx = bx - ax, dy = by - ay, square = dx * dx + dy * dy;
      const w = square > 0 ? Math.min(1, Math.max(0, ((point[0] - ax) * dx + (point[1] - ay) * dy) / square)) : 0;
      const time = rows[k].time + w * (rows[k + 1].time - rows[k].time);
      let away = Math.abs(time - now) / whole;
      if (this.live.loops) away = Math.min(away, 1 - away);
      const far = Math.hypot(ax + w * dx - point[0], ay + w * dy - point[1]) + 0.15 * size * away;
      if (far < best) { best = far; found = time; }
    }
    return found;
  }

  at(time) {
    const {times} = this.film;
    const last = this.live.loops ? this.live.end - 1e-9 : times.at(-1);
    time = Math.min(Math.max(time, times[0]), last);
    let frame = 0;
    while (frame + 1 < times.length && times[frame + 1] <= time + 1e-12) frame += 1;
    this.frame = frame;
    this.instant = time;
    this.draw();
  }

  seek(frame, playing = false) {
    this.instant = null;
    super.seek(frame, playing);
  }

  now() {
    return this.instant ?? this.film.times[this.frame];
  }

  time(frame) {
    return frame === this.frame ? this.now() : this.film.times[frame];
  }

  /* --- drawing --- */

  /* World coordinates of a body's point, from the outputs. */
  where(values, body, [x, y]) {
    if (!this.live.places[body].length) return [x, y];
    const [px, py, c, s] = this.live.places[body].map((k) => values[k]);
    return [px + c * x - s * y, py + s * x + c * y];
  }

  rates(time) {
    const found = {}, h = 2e-3 * Math.max(1e-6, this.live.end - this.film.times[0]);
    if (!this.live.rates.length) return found;
    const rows = [-2, -1, 0, 1, 2].map((k) => this.outputs(time + k * h));
    for (const [number, order] of this.live.rates) {
      const [a, b, c, d, e] = rows.map((row) => (row ? row[number] : NaN));
      let value = order === 1 ? (a - 8 * b + 8 * d - e) / (12 * h) : (-a + 16 * b - 30 * c + 16 * d - e) / (12 * h * h);
      if (!Number.isFinite(value) && order === 1) {  // at an end
        const [p, q, r] = [0, 1, 2].map((k) => this.outputs(time + k * h)?.[number]);
        value = (-3 * p + 4 * q - r) / (2 * h);
        if (!Number.isFinite(value)) value = (3 * c - 4 * b + a) / (2 * h);
      }
      found[`${number}_${order}`] = Number.isFinite(value) ? value : 0;
    }
    return found;
  }

  draw() {
    if (!this.begins || !this.images) return;
    const time = this.now(), values = this.outputs(time) ?? this.last ?? this.track.find((row) => row.values)?.values;
    this.solved = this.outputs(time) !== null;
    this.box.classList.toggle("broken", !this.solved);
    if (!values) { this.context.clearRect(0, 0, this.canvas.width, this.canvas.height); return; }
    this.last = values;
    const numbers = this.code.picture(values, this.rates(time), this.measured, this.constants, time);
    for (const [owner, key, k] of this.holes) owner[key] = Number(numbers[k]);
    for (const [part, points] of this.hulls) part.rings = [hullOf(points)];
    for (const [part, rings] of this.grown) {
      const [cx, cy] = part.centre, {scale} = part;
      part.rings = rings.map((ring) => ring.map(([x, y]) => [cx + scale * x, cy + scale * y]));
    }
    super.draw();
    this.showGrip(values, time);
  }

  showGrip(values, time) {
    if (!this.knob) return;
    const [a, b, c, d, e, f] = this.film.toImage, [x, y] = this.grip(values);
    this.knob.style.left = `${100 * (a * x + c * y + e) / this.film.width}%`;
    this.knob.style.top = `${100 * (b * x + d * y + f) / this.film.height}%`;
    this.knob.setAttribute("aria-valuenow", time.toFixed(4));
    this.knob.setAttribute("aria-valuetext", `time ${time.toFixed(2)}`);
  }

  /* A plate is its hull, with a border as wide as its radius. */
  part(part, rings = part.rings) {
    if (part.form !== "hull") { super.part(part, rings); return; }
    super.part({...part, form: "fill"}, rings);
    super.part({...part, form: "stroke"}, rings);
  }

  words(mark) {
    if (!mark.pieces) { super.words(mark); return; }
    const context = this.context, {slant, middle} = this.live, size = mark.height / this.live.units, found = [];
    let width = 0;
    for (const piece of mark.pieces) {
      if (piece.path !== undefined) { found.push([piece.path, width]); width += piece.width; continue; }
      for (const letter of pythonFormat(piece.value, piece.spec)) {
        const [path, wide] = this.live.glyphs[letter] ?? ["", 0.5];
        found.push([path, width]);
        width += wide;
      }
    }
    const shift = mark.align === "left" ? 0 : -(mark.align === "right" ? 1 : 0.5) * width * mark.height;
    const down = mark.align === "middle" ? -middle * mark.height : 0;
    context.save();
    context.translate(mark.start[0] + shift, mark.start[1] + down);
    context.transform(size, 0, mark.italic ? slant * size : 0, size, 0, 0);
    for (const [path, x] of found) {
      context.save();
      context.translate(x * this.live.units, 0);
      this.glyph(path);
      context.restore();
    }
    context.restore();
  }

  glyph(path) {
    if (!this.paths.has(path)) this.paths.set(path, new Path2D(path));
    this.context.fill(this.paths.get(path), "evenodd");
  }

  /* The path of a trace, followed with these constants. */
  throughFrames(trace) {
    const whole = trace.whole, until = this.now(), points = [];
    for (const row of this.track) {
      if (!whole && row.time > until + 1e-12) break;
      points.push([...(row.values ? this.where(row.values, trace.body, trace.point) : [0, 0]), row.values !== null, row.time]);
    }
    const here = whole ? null : this.outputs(until);
    if (here) points.push([...this.where(here, trace.body, trace.point), true, until]);
    return points;
  }

  rows(trace) {
    return this.throughFrames(trace);
  }

  anchorsAt(time) {
    const values = this.outputs(time);
    if (!values) return null;
    const found = {};
    this.film.bodies.forEach((body, k) => {
      for (const [name, point] of Object.entries(body.anchors)) found[`${body.name}.${name}`] = this.where(values, k, point);
    });
    return found;
  }

  state() {
    const constants = Object.fromEntries(this.live.sliders.map(({name, code}) => [name, this.constants[code]]));
    const bounds = Object.fromEntries(this.live.sliders.map(({name, code}) => [name, this.bounds[code] ?? null]));
    return {...super.state(), constants, bounds, solved: this.solved, gaps: this.gaps, dragMs: this.dragMs};
  }
}

function shortNumber(value) {
  return String(Number(value.toPrecision(6)));
}

/* The corners of the convex hull (Andrew's monotone chain). */
function hullOf(points) {
  const ordered = [...points].sort((p, q) => p[0] - q[0] || p[1] - q[1]);
  const half = (some) => {
    const chain = [];
    for (const point of some) {
      while (chain.length > 1) {
        const [[ax, ay], [bx, by]] = chain.slice(-2);
        if ((bx - ax) * (point[1] - ay) > (by - ay) * (point[0] - ax)) break;
        chain.pop();
      }
      chain.push(point);
    }
    return chain.slice(0, -1);
  };
  return ordered.length > 1 ? [...half(ordered), ...half(ordered.reverse())] : ordered;
}

/* A number as Python's format writes it; a zero has no sign, and no value is a dash. */
function pythonFormat(value, spec) {
  const match = /^(?:(.)?([<>=^]))?([-+ ]?)(z?)(#?)(0?)(\d*)([,_]?)(?:\.(\d+))?([a-zA-Z%]?)$/su.exec(spec);
  if (!Number.isFinite(value)) return "\u2013";
  if (!match) return String(value);
  const [, filling = match[6] ? "0" : " ", align = match[6] ? "=" : ">", sign, , , , width, group, places, kind] = match;
  const size = Math.abs(value);
  let text;
  if ("bcdoxX".includes(kind) && kind) {
    text = BigInt(fixed(size, 0)).toString({b: 2, o: 8, x: 16, X: 16}[kind] ?? 10);
    if (kind === "X") text = text.toUpperCase();
  } else if (kind === "%") text = `${fixed(size * 100, Number(places ?? 6))}%`;
  else if (kind === "f" || kind === "F") text = fixed(size, Number(places ?? 6));
  else if (kind === "e" || kind === "E") text = exponent(size.toExponential(Number(places ?? 6)));
  else if (kind === "" && places === undefined) text = plainText(size);
  else text = general(size, Math.max(1, Number(places ?? 6)), kind === "");
  if (kind === "E" || kind === "G") text = text.toUpperCase();
  if (group) text = text.replace(/^\d+/, (digits) => digits.replace(/\B(?=(\d{3})+$)/g, group));
  const minus = value < 0 && (/[xX]/.test(kind) ? /[1-9a-fA-F]/ : /[1-9]/).test(text) ? "-" : sign === "-" ? "" : sign;
  const missing = Math.max(0, Number(width || 0) - minus.length - text.length);
  if (align === "=") return minus + filling.repeat(missing) + text;
  const left = align === "<" ? 0 : align === "^" ? Math.floor(missing / 2) : missing;
  return filling.repeat(left) + minus + text + filling.repeat(missing - left);
}

/* Rounded half to even, as Python does. */
function fixed(size, places) {
  if (size >= 1e21) return BigInt(size).toString() + (places ? `.${"0".repeat(places)}` : "");
  const long = size.toFixed(Math.min(100, places + 30)), cut = long.length - (Math.min(100, places + 30) - places);
  const rest = long.slice(cut).replace(".", "");
  if (!/^50*$/.test(rest)) return size.toFixed(places);
  const down = long.slice(0, places ? cut : cut).replace(/\.$/, "");
  return Number(down.at(-1)) % 2 === 0 ? down : size.toFixed(places);
}

function exponent(text) {
  return text.replace(/e([+-])(\d)$/, "e$10$2");
}

function plainText(size) {
  const [digits, power] = size.toExponential().split("e");
  if (size !== 0 && (power < -4 || power >= 16)) return exponent(`${digits}e${power < 0 ? "-" : "+"}${Math.abs(power)}`);
  const text = size.toString();
  return text.includes(".") ? text : `${text}.0`;
}

function general(size, places, whole) {
  const power = size === 0 ? 0 : Number(size.toExponential(places - 1).split("e")[1]);
  if (power < -4 || power >= places - (whole ? 1 : 0)) {
    return exponent(size.toExponential(places - 1).replace(/\.?0+e/, "e"));
  }
  const text = fixed(size, places - 1 - power), short = text.includes(".") ? text.replace(/\.?0+$/, "") : text;
  return whole && !short.includes(".") ? `${short}.0` : short;
}
