/* Plays a film: draws its display list on a canvas, frame by frame. No library, no request.
 *
 *   const player = new MovimentumPlayer(element, film);   // film: what `movimentum.vector.page` writes as JSON
 *   player.seek(12); player.play(); player.pause();
 *   player.state();            // {time, frame, frames, playing, anchors: {"Rod.B": [x, y]}}, world coordinates, y up
 *   player.toScreen([x, y]);   // page pixels
 *
 * Marks are measured from their bodies' pivots, in world pixels, y up; a body's pose in a frame is where its pivot is
 * and its turn in degrees. A number of the film that changes is given as [offset]: frame k's value is at offset + k in
 * the poses (little-endian 32-bit floats, base64).
 */
"use strict";

class MovimentumPlayer {
  constructor(element, film) {
    this.film = film;
    this.frame = 0;
    this.playing = false;
    this.speed = 1;
    this.loop = film.loop === 0;
    this.rounds = film.loop;
    this.poses = this.floats(film.poses);
    this.tracing = film.traces.length > 0;
    this.traces = film.traces.length > 0 ? film.traces : this.everyAnchor();
    this.paths = new Map();
    this.tints = new Map();
    this.build(element);
    this.images = film.images.map((source) => {
      const image = new Image();
      image.onload = () => this.draw();
      image.src = source;
      return image;
    });
    this.ready = Promise.all(this.images.map((image) => image.decode().catch(() => {}))).then(() => this.draw());
    this.resize();
    new ResizeObserver(() => this.resize()).observe(this.canvas);
    const calm = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (film.frames > 1 && !calm) this.play();
  }

  /* --- the film's numbers --- */

  floats(text) {
    const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    return Float32Array.from({length: bytes.length / 4}, (_, k) => view.getFloat32(4 * k, true));
  }

  value(number, frame) {
    return Array.isArray(number) ? this.poses[number[0] + frame] : number;
  }

  /* World coordinates of a point that is measured from a body's pivot. */
  world(index, x, y, frame) {
    const body = this.film.bodies[index];
    const turn = this.value(body.angle, frame) * Math.PI / 180;
    const c = Math.cos(turn), s = Math.sin(turn);
    return [this.value(body.x, frame) + c * x - s * y, this.value(body.y, frame) + s * x + c * y];
  }

  everyAnchor() {
    const found = [];
    this.film.bodies.forEach((body, index) => {
      for (const point of Object.values(body.anchors)) {
        const plain = {opacity: 1, dash: [], cap: "round", tail: null, past: []};
        found.push({body: index, point, color: body.color, width: this.film.traceWidth, ...plain});
      }
    });
    return found;
  }

  time(frame) {
    return this.film.times[frame];
  }

  /* --- the page --- */

  build(element) {
    const make = (tag, attributes, parent) => {
      const made = document.createElement(tag);
      for (const [name, value] of Object.entries(attributes)) {
        if (name === "text") made.textContent = value; else made.setAttribute(name, value);
      }
      if (parent) parent.append(made);
      return made;
    };
    const film = this.film;
    element.classList.add("movimentum");
    const label = `${film.title}: ${film.frames} frame${film.frames === 1 ? "" : "s"}`;
    this.canvas = make("canvas", {"data-testid": "stage", role: "img", "aria-label": label}, element);
    this.canvas.style.width = `${film.width}px`;
    this.canvas.style.aspectRatio = `${film.width} / ${film.height}`;
    this.context = this.canvas.getContext("2d");
    const bar = make("div", {class: "controls", role: "group", "aria-label": "Player"}, element);
    if (film.frames < 2) bar.hidden = true;
    const button = (name, text, title, act) => {
      const made = make("button", {type: "button", "data-testid": name, text, title, "aria-label": title}, bar);
      made.addEventListener("click", (event) => {
        act();
        if (event.detail > 0) made.blur();  // after the mouse, the space bar plays
      });
      return made;
    };
    this.playButton = button("play", "", "", () => this.toggle());
    button("back", "\u2039", "One frame back (left arrow)", () => this.step(-1));
    button("forward", "\u203a", "One frame on (right arrow)", () => this.step(1));
    const range = {type: "range", min: 0, max: film.frames - 1, step: 1, value: 0};
    this.scrubber = make("input", {...range, "data-testid": "scrubber", "aria-label": "Frame"}, bar);
    this.scrubber.addEventListener("input", () => { this.pause(); this.seek(Number(this.scrubber.value)); });
    this.clock = make("output", {"data-testid": "time"}, bar);
    this.speedChoice = make("select", {"data-testid": "speed", "aria-label": "Speed", title: "Speed"}, bar);
    for (const [speed, text] of [[1, "1\u00d7"], [0.5, "\u00bd\u00d7"], [0.25, "\u00bc\u00d7"]]) {
      make("option", {value: speed, text}, this.speedChoice);
    }
    this.speedChoice.addEventListener("change", () => this.setSpeed(Number(this.speedChoice.value)));
    this.loopButton = button("loop", "Loop", "Play again and again", () => this.setLoop(!this.loop));
    this.traceButton = button("traces", "Traces", "Show the paths of anchors", () => this.setTracing(!this.tracing));
    this.setLoop(this.loop);
    this.setTracing(this.tracing);
    this.showPlaying();
    if (film.frames > 1) document.addEventListener("keydown", (event) => this.key(event));
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const name = event.target.tagName;
    if (name === "SELECT" || name === "TEXTAREA" || (name === "INPUT" && event.target !== this.scrubber)) return;
    const last = this.film.frames - 1;
    if (event.key === " ") {
      if (name === "BUTTON") return;  // it presses the button
      this.toggle();
    } else if (event.key === "ArrowLeft") this.step(-1);
    else if (event.key === "ArrowRight") this.step(1);
    else if (event.key === "Home") { this.pause(); this.seek(0); }
    else if (event.key === "End") { this.pause(); this.seek(last); }
    else return;
    event.preventDefault();
  }

  resize() {
    const fine = window.devicePixelRatio || 1;
    const width = Math.max(1, Math.round((this.canvas.clientWidth || this.film.width) * fine));
    const height = Math.max(1, Math.round(width * this.film.height / this.film.width));
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    this.draw();
  }

  /* --- playing --- */

  play() {
    if (this.playing || this.film.frames < 2) return;
    if (this.frame === this.film.frames - 1) this.frame = 0;
    this.playing = true;
    this.began(this.frame);
    this.showPlaying();
    const tick = (now) => {
      if (!this.playing) return;
      const passed = Math.floor((now - this.since) / 1000 * this.film.fps * this.speed + 1e-6);
      let frame = this.from + Math.max(0, passed);
      if (frame >= this.film.frames) {
        this.rounds -= 1;
        if (!this.loop && this.rounds < 1) {
          this.seek(this.film.frames - 1);
          this.pause();
          this.rounds = this.film.loop;
          return;
        }
        frame %= this.film.frames;
        this.began(frame);
      }
      if (frame !== this.frame) this.seek(frame, true);
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  began(frame) {
    this.from = frame;
    this.since = performance.now();
  }

  pause() {
    this.playing = false;
    this.showPlaying();
  }

  toggle() {
    if (this.playing) this.pause(); else this.play();
  }

  step(frames) {
    this.pause();
    const count = this.film.frames;
    this.seek((this.frame + frames + count) % count);
  }

  seek(frame, playing = false) {
    this.frame = Math.min(Math.max(0, Math.round(frame)), this.film.frames - 1);
    if (this.playing && !playing) this.began(this.frame);
    this.draw();
  }

  setSpeed(speed) {
    this.speed = speed;
    this.speedChoice.value = String(speed);
    this.began(this.frame);
  }

  setLoop(loop) {
    this.loop = loop;
    this.loopButton.setAttribute("aria-pressed", String(loop));
  }

  setTracing(tracing) {
    this.tracing = tracing;
    this.traceButton.setAttribute("aria-pressed", String(tracing));
    if (this.images) this.draw();
  }

  showPlaying() {
    this.playButton.textContent = this.playing ? "\u275a\u275a" : "\u25b6";
    const title = this.playing ? "Pause (space)" : "Play (space)";
    this.playButton.title = title;
    this.playButton.setAttribute("aria-label", title);
    this.playButton.setAttribute("aria-pressed", String(this.playing));
  }

  state() {
    const anchors = {};
    this.film.bodies.forEach((body, index) => {
      for (const [name, [x, y]] of Object.entries(body.anchors)) {
        anchors[`${body.name}.${name}`] = this.world(index, x, y, this.frame);
      }
    });
    const {frame, playing, speed, film} = this;
    return {time: this.time(frame), frame, frames: film.frames, playing, speed, anchors};
  }

  toScreen([x, y]) {
    const [a, b, c, d, e, f] = this.film.toImage;
    const box = this.canvas.getBoundingClientRect();
    const scale = box.width / this.film.width;
    return [box.left + window.scrollX + scale * (a * x + c * y + e),
            box.top + window.scrollY + scale * (b * x + d * y + f)];
  }

  /* --- drawing --- */

  draw() {
    if (!this.images) return;
    const film = this.film, context = this.context;
    const scale = this.canvas.width / film.width;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.globalAlpha = 1;
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    if (film.background) {
      context.fillStyle = film.background;
      context.fillRect(0, 0, this.canvas.width, this.canvas.height);
    }
    context.setTransform(scale, 0, 0, scale, 0, 0);
    context.transform(...film.toImage);
    context.lineCap = context.lineJoin = "round";
    context.imageSmoothingEnabled = true;
    context.imageSmoothingQuality = "high";
    for (const path of film.paths) this.drawPath(path, path.past.map(([x, y, shown]) => [x, y, shown]));
    for (const mark of film.marks) this.drawMark(mark);
    if (this.tracing) for (const trace of this.traces) this.drawTrace(trace);
    for (const mark of film.overlays) this.drawMark(mark);
    this.scrubber.value = String(this.frame);
    const time = `${this.time(this.frame).toFixed(2)}`;
    this.clock.textContent = `${time} \u00b7 ${this.frame + 1}/${film.frames}`;
    this.scrubber.setAttribute("aria-valuetext", `frame ${this.frame + 1} of ${film.frames}, time ${time}`);
  }

  drawMark(mark) {
    const context = this.context, frame = this.frame;
    const opacity = this.value(mark.opacity, frame);
    if (opacity <= 0) return;
    const channels = mark.color.map((channel) => Math.round(this.value(channel, frame)));
    const color = `rgb(${channels.join(",")})`;
    context.save();
    context.globalAlpha = opacity;
    context.fillStyle = context.strokeStyle = color;
    this.strokes = mark.width > 0;  // a canvas would not take the width 0
    if (this.strokes) context.lineWidth = mark.width;
    if (mark.kind === "link") {
      this.line(mark.through.map(([body, x, y]) => this.world(body, x, y, frame)));
    } else if (mark.kind === "symbol") {
      this.together(opacity, () => this.symbol(mark));
    } else {
      const body = this.film.bodies[mark.body];
      context.translate(this.value(body.x, frame), this.value(body.y, frame));
      const turn = this.value(body.angle, frame) * Math.PI / 180;
      if (mark.kind === "note") {
        context.rotate(turn);
        context.translate(...mark.point);
        context.rotate(-turn);
        this.note(mark);
      } else {
        context.rotate(turn);
        if (mark.kind === "line") this.arrow(mark);
        else if (mark.kind === "disc") this.disc(mark);
        else if (mark.kind === "image") this.image(mark, channels);
        else if (mark.kind === "figure") this.together(opacity, () => mark.parts.forEach((part) => this.part(part)));
        else if (mark.kind === "text") this.text(mark);
        else if (mark.kind === "words") this.words(mark);
      }
    }
    context.restore();
  }

  line(points) {
    const context = this.context;
    if (!this.strokes) return;
    context.beginPath();
    points.forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
    if (points.length === 1) context.lineTo(...points[0]);
    context.stroke();
  }

  /* A line, with a head where it is an arrow: as one shape, so that nothing shows through it twice. */
  arrow(mark) {
    if (!mark.head) { this.line(mark.points); return; }
    this.together(this.context.globalAlpha, () => {
      const context = this.context;
      this.line(mark.points);
      context.beginPath();
      mark.head.forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
      context.fill();
    });
  }

  /* Several shapes, faded as one. */
  together(opacity, paint) {
    if (opacity >= 1) paint(); else this.layered(opacity, paint);
  }

  /* A part of a figure: a stroke, a filled outline or a dot. */
  part(part, rings = part.rings) {
    const context = this.context;
    context.save();
    if (part.color) context.fillStyle = context.strokeStyle = part.color;
    context.beginPath();
    if (part.form === "dot") {
      context.arc(rings[0][0][0], rings[0][0][1], part.width, 0, 2 * Math.PI);
    } else {
      for (const ring of rings) {
        ring.forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
        if (part.closed || part.form === "fill") context.closePath();
      }
    }
    if (part.form === "stroke") {
      context.lineWidth = part.width;
      context.lineCap = part.cap;
      context.setLineDash(part.dash);
      context.stroke();
    } else {
      context.fill();
    }
    context.restore();
  }

  /* What is drawn anew in every frame. */
  symbol(mark) {
    const frame = this.frame;
    for (const part of mark.parts) {
      if (this.value(part.shown, frame) <= 0) continue;
      const ring = [];
      for (let k = 0; k < part.moving.length; k += 2) {
        ring.push([this.value(part.moving[k], frame), this.value(part.moving[k + 1], frame)]);
      }
      this.part(part, [ring]);
    }
    if (!mark.caption) return;
    this.context.save();
    this.context.translate(this.value(mark.caption.x, frame), this.value(mark.caption.y, frame));
    this.words(mark.caption);
    this.context.restore();
  }

  /* A text that may be another one in every frame. */
  words(mark) {
    this.text(mark.texts[this.value(mark.which, this.frame)]);
  }

  /* Paint at full opacity on a canvas of its own, then lay that over the picture. */
  layered(opacity, paint) {
    const below = this.context;
    const sheet = document.createElement("canvas");
    sheet.width = this.canvas.width;
    sheet.height = this.canvas.height;
    const context = sheet.getContext("2d");
    context.setTransform(below.getTransform());
    for (const name of ["fillStyle", "strokeStyle", "lineWidth", "lineCap", "lineJoin"]) context[name] = below[name];
    this.context = context;
    paint();
    this.context = below;
    below.save();
    below.setTransform(1, 0, 0, 1, 0, 0);
    below.globalAlpha = opacity;
    below.drawImage(sheet, 0, 0);
    below.restore();
  }

  disc(mark) {
    const context = this.context;
    context.beginPath();
    context.arc(mark.centre[0], mark.centre[1], mark.radius, 0, 2 * Math.PI);
    if (mark.width === null) context.fill();
    else if (this.strokes) context.stroke();
  }

  image(mark, channels) {
    const image = this.images[mark.image];
    if (!image.complete || image.naturalWidth === 0) return;
    this.context.transform(...mark.matrix);
    this.context.drawImage(channels.every((channel) => channel === 255) ? image : this.tinted(image, channels), 0, 0);
  }

  /* The image with its colours multiplied by a tint; the last few are kept. */
  tinted(image, channels) {
    const key = `${this.images.indexOf(image)} ${channels.join(" ")}`;
    if (!this.tints.has(key)) {
      if (this.tints.size > 64) this.tints.clear();
      const sheet = document.createElement("canvas");
      sheet.width = image.naturalWidth;
      sheet.height = image.naturalHeight;
      const context = sheet.getContext("2d");
      context.drawImage(image, 0, 0);
      context.globalCompositeOperation = "multiply";
      context.fillStyle = `rgb(${channels.join(",")})`;
      context.fillRect(0, 0, sheet.width, sheet.height);
      context.globalCompositeOperation = "destination-in";
      context.drawImage(image, 0, 0);
      this.tints.set(key, sheet);
    }
    return this.tints.get(key);
  }

  text(mark) {
    const context = this.context;
    if (!this.paths.has(mark)) this.paths.set(mark, new Path2D(mark.path));
    context.transform(...mark.matrix);
    if (mark.halo) {
      const ink = context.fillStyle;
      context.strokeStyle = context.fillStyle = this.film.paper;
      context.lineWidth = mark.halo;
      context.stroke(this.paths.get(mark));
      context.fillStyle = ink;
    }
    context.fill(this.paths.get(mark), "evenodd");
  }

  note(mark) {
    const context = this.context;
    if (mark.dot > 0) {
      context.beginPath();
      context.arc(0, 0, mark.dot, 0, 2 * Math.PI);
      const ink = context.fillStyle;
      context.fillStyle = this.film.paper;
      context.fill();
      context.fillStyle = context.strokeStyle = ink;
      context.lineWidth = mark.edge;
      context.stroke();
    }
    this.text(mark);
  }

  drawTrace(trace) {
    const body = this.film.bodies[trace.body];
    const points = trace.past.slice();
    for (let frame = 0; frame <= this.frame; frame += 1) {
      const shown = this.value(body.visible, frame) > 0;
      points.push([...(shown ? this.world(trace.body, ...trace.point, frame) : [0, 0]), shown, this.time(frame)]);
    }
    if (trace.closing && this.frame === this.film.frames - 1) points.push(trace.closing);
    if (trace.tail) this.drawTail(trace, points); else this.drawPath(trace, points);
  }

  drawPath(trace, points) {
    const context = this.context;
    context.save();
    context.beginPath();
    let pen = false;
    for (const [x, y, shown] of points) {
      if (!shown) { pen = false; continue; }
      if (!pen) context.moveTo(x, y);
      context.lineTo(x, y);
      pen = true;
    }
    this.inkTrace(trace);
    context.setLineDash(trace.dash);
    context.lineCap = trace.cap;
    context.stroke();
    context.restore();
  }

  /* The last steps of a path several times over each other, each time fewer: what is newer is covered more often. */
  drawTail(trace, points) {
    const now = this.time(this.frame), bands = 12;
    const paint = () => {
      const context = this.context;
      context.lineCap = trace.cap;
      for (let band = 1; band <= bands; band += 1) {
        const from = now - trace.tail * (1 - (band - 0.5) / bands);
        context.globalAlpha = 1 / (bands - band + 1);
        context.beginPath();
        for (let k = 1; k < points.length; k += 1) {
          const [ax, ay, seen, begin] = points[k - 1], [bx, by, still, end] = points[k];
          if (!seen || !still || end <= from) continue;
          const cut = Math.max(0, (from - begin) / (end - begin));
          if (cut > 0 || k === 1 || !points[k - 2][2] || points[k - 1][3] <= from) {
            context.moveTo(ax + cut * (bx - ax), ay + cut * (by - ay));
          }
          context.lineTo(bx, by);
        }
        context.stroke();
      }
    };
    this.context.save();
    this.inkTrace(trace);
    this.together(this.context.globalAlpha, paint);
    this.context.restore();
  }

  inkTrace(trace) {
    const channels = trace.color.map((channel) => Math.round(this.value(channel, this.frame)));
    this.context.globalAlpha = this.value(trace.opacity, this.frame);
    this.context.strokeStyle = `rgb(${channels.join(",")})`;
    this.context.lineWidth = trace.width;
  }
}

for (const data of document.querySelectorAll("script[data-movimentum]")) {
  const player = new MovimentumPlayer(document.getElementById(data.dataset.movimentum), JSON.parse(data.textContent));
  window.movimentum = window.movimentum || player;
}
