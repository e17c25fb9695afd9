/* Draws a film's display list on a canvas, frame by frame. No library, no request.
 *
 *   const painter = new MovimentumPainter(film, canvas);   // film: what `movimentum.vector.page` writes as JSON
 *   painter.frame = 12; painter.draw();
 *   painter.toScreen([x, y]);   // page pixels of a world point, y up
 *
 * Marks are measured from their bodies' pivots, in world pixels, y up; a body's pose in a frame is where its pivot is
 * and its turn in degrees. A number of the film that changes is given as [offset]: frame k's value is at offset + k in
 * the poses (little-endian 32-bit floats, base64).
 */
"use strict";

class MovimentumPainter {
  constructor(film, canvas) {
    this.film = film;
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.frame = 0;
    this.poses = this.floats(film.poses);
    this.tracing = film.traces.length > 0;
    this.traces = film.traces.length > 0 ? film.traces : this.everyAnchor();
    this.paths = new Map();
    this.tints = new Map();
    this.images = null;
  }

  /* Load the film's pictures; then it can be drawn. */
  load() {
    this.images = this.film.images.map((source) => {
      const image = new Image();
      image.onload = () => this.draw();
      image.src = source;
      return image;
    });
    this.ready = Promise.all(this.images.map((image) => image.decode().catch(() => {}))).then(() => this.draw());
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

  /* Where a body's pivot is, and its turn in degrees. */
  pose(index, frame) {
    const body = this.film.bodies[index];
    return [this.value(body.x, frame), this.value(body.y, frame), this.value(body.angle, frame)];
  }

  /* World coordinates of a point that is measured from a body's pivot. */
  world(index, x, y, frame) {
    const [px, py, degrees] = this.pose(index, frame);
    const turn = degrees * Math.PI / 180;
    const c = Math.cos(turn), s = Math.sin(turn);
    return [px + c * x - s * y, py + s * x + c * y];
  }

  everyAnchor() {
    const found = [];
    this.film.bodies.forEach((body, index) => {
      for (const point of Object.values(body.anchors)) {
        const plain = {opacity: 1, dash: [], cap: "round", tail: null};
        found.push({body: index, point, color: body.color, width: this.film.traceWidth, ...plain});
      }
    });
    return found;
  }

  time(frame) {
    return this.film.times[frame];
  }

  toScreen([x, y]) {
    const [a, b, c, d, e, f] = this.film.toImage;
    if (this.film.camera) {
      const [zoom, right, up] = this.film.camera.map((number) => this.value(number, this.frame));
      [x, y] = [zoom * x + right, zoom * y + up];
    }
    const box = this.canvas.getBoundingClientRect();
    const scale = box.width / this.film.width;
    return [box.left + window.scrollX + scale * (a * x + c * y + e),
            box.top + window.scrollY + scale * (b * x + d * y + f)];
  }

  /* --- drawing --- */

  draw() {
    if (!this.images) return;
    const film = this.film, context = this.context;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.globalAlpha = 1;
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.lay(context);
    context.lineCap = context.lineJoin = "round";
    context.imageSmoothingEnabled = true;
    context.imageSmoothingQuality = "high";
    this.drawFilm(film.camera);
    this.drawMarks(film.beside || []);
    this.drawMarks(film.overlays, film.camera);
  }

  /* The film itself, which insets show too (without what is still): under a map of the world. */
  drawFilm(camera, inset = false) {
    const film = this.film, shown = (things) => things.filter((thing) => !(inset && thing.still));
    const lines = (traces, paint) => {
      for (const trace of shown(traces)) this.mapped(trace.still ? null : camera, () => paint(trace));
    };
    lines(film.paths, (path) => this.drawPath(path, this.rows(path)));
    this.drawMarks(shown(film.marks), camera);
    if (this.tracing) lines(this.traces, (trace) => this.drawTrace(trace));
  }

  /* Paint with everything larger by a zoom, then moved by x and y. */
  mapped(camera, paint) {
    if (!camera) { paint(); return; }
    const [zoom, x, y] = camera.map((number) => this.value(number, this.frame));
    this.context.save();
    this.context.transform(zoom, 0, 0, zoom, x, y);
    paint();
    this.context.restore();
  }

  /* The background, and the way from world to canvas. */
  lay(context) {
    const film = this.film;
    if (film.background) {
      context.fillStyle = film.background;
      context.fillRect(0, 0, this.canvas.width, this.canvas.height);
    }
    const scale = this.canvas.width / film.width;
    context.setTransform(scale, 0, 0, scale, 0, 0);
    context.transform(...film.toImage);
  }

  /* Marks from back to front; those of a group, which are beside each other, are faded as one. */
  drawMarks(marks, camera = null) {
    const draw = (mark) => this.mapped(mark.still ? null : camera, () => this.drawMark(mark));
    const thing = (mark) => mark && mark.group && mark.group.thing;
    for (let k = 0, end; k < marks.length; k = end) {
      end = k + 1;
      const group = marks[k].group;
      while (group && thing(marks[end]) === group.thing) end += 1;
      const some = marks.slice(k, end), opacity = group ? this.value(group.opacity, this.frame) : 1;
      if (opacity > 0) this.together(opacity, () => some.forEach(draw));
    }
  }

  drawMark(mark) {
    const context = this.context, frame = this.frame;
    const opacity = this.value(mark.opacity, frame);
    if (opacity <= 0) return;
    const channels = mark.color.map((channel) => Math.round(this.value(channel, frame)));
    const color = `rgb(${channels.join(",")})`;
    context.save();
    if (mark.clip) {
      context.beginPath();
      this.ring(mark.clip).forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
      context.clip();
    }
    context.globalAlpha = opacity;
    context.fillStyle = context.strokeStyle = color;
    this.strokes = mark.width > 0;  // a canvas would not take the width 0
    if (this.strokes) context.lineWidth = mark.width;
    if (mark.kind === "link") {
      this.line(mark.through.map(([body, x, y]) => this.world(body, x, y, frame)));
    } else if (mark.kind === "inset") {
      this.together(opacity, () => this.inset(mark));
    } else if (mark.kind === "symbol") {
      this.together(opacity, () => this.symbol(mark));
    } else {
      const [x, y, degrees] = this.pose(mark.body, frame);
      context.translate(x, y);
      const turn = degrees * Math.PI / 180;
      if (mark.kind === "note") {
        context.rotate(turn);
        context.translate(...mark.point);
        context.rotate(-turn);
        this.note(mark);
      } else {
        context.rotate(turn);
        if (mark.scale !== undefined) {
          const [u, v] = mark.about, size = this.value(mark.scale, frame);
          context.translate(u, v);
          context.scale(size, size);
          context.translate(-u, -v);
        }
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
    this.through(points);
    context.stroke();
  }

  /* A canvas draws nothing where a line has no length: a dot is a line that is a speck long. */
  through(points) {
    const context = this.context, [left, top] = points[0] ?? [];
    points.forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
    if (points.every(([x, y]) => x === left && y === top)) context.lineTo(left + 0.002, top);
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

  /* A part of a figure: a stroke, a filled outline, a dot or a ring. */
  part(part, rings = part.rings) {
    const context = this.context;
    context.save();
    if (part.color) context.fillStyle = context.strokeStyle = part.color;
    context.beginPath();
    if (part.form === "dot" || part.form === "ring") {
      context.arc(rings[0][0][0], rings[0][0][1], part.form === "dot" ? part.width : part.radius, 0, 2 * Math.PI);
    } else {
      for (const ring of rings) {
        ring.forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
        if (part.closed || part.form === "fill") context.closePath();
      }
    }
    if (part.form === "stroke" || part.form === "ring") {
      context.lineWidth = part.width;
      context.lineCap = part.cap;
      context.setLineDash(part.dash);
      context.stroke();
    } else {
      context.fill();
    }
    context.restore();
  }

  /* A part of the film once more, in a frame. */
  inset(mark) {
    const context = this.context;
    context.save();
    context.beginPath();
    this.ring(mark.frame).forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.clip();
    if (mark.paper) context.fillStyle = mark.paper;
    context.fill();
    this.drawFilm(mark.camera, true);
    context.restore();
    this.symbol(mark);
  }

  /* Points that change, given as x and y in turn. */
  ring(columns) {
    const points = [];
    for (let k = 0; k < columns.length; k += 2) {
      points.push([this.value(columns[k], this.frame), this.value(columns[k + 1], this.frame)]);
    }
    return points;
  }

  /* What is drawn anew in every frame. */
  symbol(mark) {
    const frame = this.frame;
    for (const part of mark.parts) {
      if (this.value(part.shown, frame) <= 0) continue;
      this.part(part, [this.ring(part.moving)]);
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
    const context = this.context;
    context.transform(...mark.matrix);
    const plain = channels.every((channel) => channel === 255);
    context.drawImage(plain ? image : this.tinted(image, channels), 0, 0, image.naturalWidth, image.naturalHeight);
  }

  /* The image with its colours multiplied by a tint, outlines as fine as they are drawn; the last few are kept. */
  tinted(image, channels) {
    const {a, b} = this.context.getTransform();
    const fine = image.src.startsWith("data:image/svg") ? Math.min(8, Math.max(1, Math.ceil(Math.hypot(a, b)))) : 1;
    const key = `${this.images.indexOf(image)} ${fine} ${channels.join(" ")}`;
    if (!this.tints.has(key)) {
      if (this.tints.size > 64) this.tints.clear();
      const sheet = document.createElement("canvas");
      sheet.width = fine * image.naturalWidth;
      sheet.height = fine * image.naturalHeight;
      const context = sheet.getContext("2d");
      context.drawImage(image, 0, 0, sheet.width, sheet.height);
      context.globalCompositeOperation = "multiply";
      context.fillStyle = `rgb(${channels.join(",")})`;
      context.fillRect(0, 0, sheet.width, sheet.height);
      context.globalCompositeOperation = "destination-in";
      context.drawImage(image, 0, 0, sheet.width, sheet.height);
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
    const points = trace.path ? this.rows(trace) : this.throughFrames(trace);
    if (trace.tail) this.drawTail(trace, points); else this.drawPath(trace, points);
  }

  /* What the frame shows of a path: x, y, whether it is visible, and when. */
  rows(trace) {
    const count = this.value(trace.ends, this.frame), points = [];
    for (let row = 0; row < count; row += 1) points.push(trace.path.map((column) => this.value(column, row)));
    return points;
  }

  /* The path of an anchor that the film does not trace: only its places in the frames are known. */
  throughFrames(trace) {
    const body = this.film.bodies[trace.body], points = [];
    for (let frame = 0; frame <= this.frame; frame += 1) {
      const shown = this.value(body.visible, frame) > 0;
      points.push([...(shown ? this.world(trace.body, ...trace.point, frame) : [0, 0]), shown, this.time(frame)]);
    }
    return points;
  }

  drawPath(trace, points) {
    const context = this.context;
    context.save();
    context.beginPath();
    let run = [];
    for (const point of [...points, [0, 0, false]]) {
      if (point[2]) { run.push(point); continue; }
      if (run.length) this.through(run);
      run = [];
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
