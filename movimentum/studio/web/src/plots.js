/* Values over time under the scrubber, several curves with one axis, its cursor under the scrubber's thumb; or one over another. */
import {byId, button, make} from "./dom.js";

const COLORS = ["--curve-1", "--curve-2", "--curve-3", "--curve-4", "--curve-5", "--curve-6"]; // of the page's style, light or dark
const THUMB = 8; // half of the scrubber's thumb, in pixels
const LEFT = 56, TOP = 8, BOTTOM = 22; // room for numbers

export class Plots {
  constructor(app) {
    this.app = app;
    this.curves = []; // {expression, over, color, rows, overRows, words}
    this.box = byId("plot");
    new ResizeObserver(() => this.draw()).observe(this.box);
  }

  /* Expressions with a semicolon between them; "y over x" is a phase plot. Nothing: no plot. */
  set(text) {
    this.curves = [];
    text.split(";").map((each) => each.trim()).filter(Boolean).forEach((each) => this.put(each));
    this.show();
  }

  add(expression) {
    if (!this.curves.some((curve) => curve.text === expression)) this.put(expression);
    this.show();
  }

  put(text) {
    const [expression, over = ""] = text.split(/\s+over\s+/);
    this.curves.push({text, expression, over, rows: null, overRows: null, words: ""});
  }

  remove(curve) {
    this.curves = this.curves.filter((each) => each !== curve);
    this.show();
  }

  show() {
    const {curves, box, app} = this;
    app.controls.expression.value = curves.map(({text}) => text).join("; ");
    curves.forEach((curve, k) => { curve.color = COLORS[k % COLORS.length]; });
    box.hidden = !curves.length;
    this.ask();
    this.build();
  }

  /* The values of the film on show. */
  ask() {
    const wanted = new Set(this.curves.flatMap(({expression, over}) => (over ? [expression, over] : [expression])));
    for (const expression of wanted) this.app.send({kind: "plot", rev: this.app.shownRev, expression});
  }

  told({rev, expression, rows, words}) {
    if (rev !== this.app.shownRev) return;
    for (const curve of this.curves) {
      if (curve.expression === expression) { curve.rows = rows; curve.words = words; }
      if (curve.over && curve.over === expression) { curve.overRows = rows; curve.words = curve.words || words; }
    }
    this.build();
  }

  build() {
    if (this.box.hidden) return;
    const bar = make("div", {class: "bar"}), told = make("output", {"data-testid": "plot-value"});
    for (const curve of this.curves) {
      const mark = make("i");
      mark.style.background = `var(${curve.color})`;
      const chip = make("span", {class: "chip"}, mark, make("span", {text: curve.text}));
      button(chip, "plot-remove", "", `Without ${curve.text}`, () => this.remove(curve), {icon: "close"});
      bar.append(chip);
    }
    bar.append(told);
    button(bar, "plot-csv", "CSV", "Save the values as CSV", () => this.save(), {icon: "export"});
    button(bar, "plot-close", "", "Close the plot", () => this.set(""), {icon: "close"});
    const label = `${this.curves.map(({text}) => text).join(", ")} over time`;
    const canvas = make("canvas", {"data-testid": "plot", role: "img", "aria-label": label, title: "Click or drag to go to a time"});
    canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); this.seek(event.offsetX); });
    canvas.addEventListener("pointermove", (event) => { if (event.buttons & 1) this.seek(event.offsetX); });
    this.sheet = make("canvas", {"aria-hidden": "true"}); // the axes; the curves lie over them, as wide as the scrubber
    this.box.replaceChildren(bar, make("div", {class: "sheet"}, this.sheet, canvas));
    this.canvas = canvas;
    this.value = told;
    this.draw();
  }

  get phase() {
    return this.curves.some(({over}) => over);
  }

  /* Where the curves are, in the sheet: under the scrubber, so that its cursor is under the thumb. */
  extent() {
    const scrubber = this.app.clock.scrubber.getBoundingClientRect(), sheet = this.sheet.getBoundingClientRect();
    if (this.phase) return [0, sheet.width];
    return [Math.max(0, scrubber.left - sheet.left), Math.min(sheet.width, scrubber.right - sheet.left)];
  }

  /* Where time begins and ends, in the sheet. */
  span() {
    const [left, right] = this.extent();
    return [left + THUMB, right - THUMB];
  }

  seek(x) {
    const {clock} = this.app;
    if (this.phase) return;
    const [from, to] = this.span(), [left] = this.extent();
    clock.pause();
    clock.seek((x + left - from) / (to - from) * (clock.frames - 1));
  }

  draw() {
    const {canvas, curves} = this;
    if (this.box.hidden || !canvas || !canvas.isConnected) return;
    const fine = window.devicePixelRatio || 1, width = this.sheet.clientWidth, height = this.sheet.clientHeight;
    const [left, right] = this.extent(), style = getComputedStyle(canvas);
    canvas.style.left = `${left}px`;
    canvas.style.width = `${right - left}px`;
    const prepared = (made, wide) => {
      made.width = Math.max(1, wide * fine);
      made.height = Math.max(1, height * fine);
      const found = made.getContext("2d");
      found.scale(fine, fine);
      return found;
    };
    const below = prepared(this.sheet, width), context = prepared(canvas, right - left);
    context.translate(-left, 0);
    const paint = {below, context, width, height, ink: style.getPropertyValue("--faint"), line: style.getPropertyValue("--line"), strong: style.getPropertyValue("--ink")};
    const known = curves.filter(({rows, over, overRows}) => rows && rows.length && (!over || (overRows && overRows.length)))
      .map((curve) => ({...curve, color: style.getPropertyValue(curve.color).trim()}));
    if (known.length) (this.phase ? this.drawPhase(paint, known) : this.drawTime(paint, known));
    this.tell();
  }

  drawTime(paint, known) {
    const {clock} = this.app, [from, to] = this.span();
    const values = known.flatMap(({rows}) => rows.flat()).filter((value) => value !== null);
    if (!values.length) return;
    const [low, high, ticks] = scale(values), begin = clock.start, end = clock.start + (clock.frames - 1) / clock.fps;
    const x = (part) => from + part * (to - from), y = (value) => TOP + (paint.height - TOP - BOTTOM) * (high - value) / (high - low);
    const [, , times] = scale([begin, end]);
    this.axes(paint, [from, to], ticks, y, times.filter((time) => time >= begin - 1e-9 && time <= end + 1e-9), (time) => (end > begin ? x((time - begin) / (end - begin)) : from), unit(known), "t");
    for (const {rows, color} of known) this.strokes(paint, rows.map((row, k) => [x(rows.length < 2 ? 0 : k / (rows.length - 1)), row.map((value) => (value === null ? null : y(value)))]), color);
    const now = x(clock.frames < 2 ? 0 : clock.frame / (clock.frames - 1));
    this.cursor = now;
    paint.context.strokeStyle = paint.strong;
    paint.context.lineWidth = 1;
    paint.context.beginPath();
    paint.context.moveTo(now, TOP - 4);
    paint.context.lineTo(now, paint.height - BOTTOM);
    paint.context.stroke();
  }

  strokes({context}, points, color) {
    const columns = points.length ? points[0][1].length : 0;
    for (let column = 0; column < columns; column += 1) {
      context.strokeStyle = color;
      context.lineWidth = 1.75;
      context.setLineDash(column ? [5, 3] : []);
      context.beginPath();
      let pen = false;
      for (const [x, ys] of points) {
        const y = ys[column];
        if (y === null || y === undefined) { pen = false; continue; }
        if (pen) context.lineTo(x, y); else context.moveTo(x, y);
        pen = true;
      }
      context.stroke();
    }
    context.setLineDash([]);
  }

  /* Numbers at the axes, with lines through the sheet. */
  axes({below: context, height, ink, line}, [from, to], ticks, y, others, x, above, right) {
    context.font = "11px system-ui, sans-serif";
    context.fillStyle = ink;
    context.strokeStyle = line;
    context.lineWidth = 1;
    context.textBaseline = "middle";
    const inside = from < LEFT - 16; // no room beside the sheet: the numbers stand on their lines
    context.textAlign = inside ? "left" : "right";
    ticks.forEach((value, k) => {
      context.beginPath();
      context.moveTo(from, y(value));
      context.lineTo(to, y(value));
      context.stroke();
      context.fillText(`${short(value)}${k === ticks.length - 1 && above ? ` ${above}` : ""}`, inside ? from + 4 : from - 6, y(value) - (inside && k ? -7 : inside ? 7 : 0));
    });
    context.textAlign = "center";
    context.textBaseline = "alphabetic";
    others.forEach((value, k) => context.fillText(k === others.length - 1 && others.length > 1 ? `${short(value)} ${right}` : short(value), Math.min(x(value), to - 10), height - 6));
  }

  drawPhase(paint, known) {
    const pairs = known.map(({rows, overRows, over, color}) => ({color, points: over ? rows.map((row, k) => [overRows[k] ? overRows[k][0] : null, row[0]]) : []}));
    const every = pairs.flatMap(({points}) => points).filter(([a, b]) => a !== null && b !== null);
    if (!every.length) return;
    const [low, high, ticks] = scale(every.map(([, b]) => b)), [left, right, others] = scale(every.map(([a]) => a));
    const [from, to] = [LEFT, paint.width - 16];
    const x = (value) => from + (to - from) * (value - left) / (right - left), y = (value) => TOP + (paint.height - TOP - BOTTOM) * (high - value) / (high - low);
    const [first] = known.filter(({over}) => over);
    this.axes(paint, [from, to], ticks, y, others, x, unit(known), unitOf(first.over));
    const {clock} = this.app, part = clock.frames < 2 ? 0 : clock.frame / (clock.frames - 1);
    for (const {points, color} of pairs) {
      const {context} = paint;
      context.strokeStyle = context.fillStyle = color;
      context.lineWidth = 1.75;
      context.beginPath();
      let pen = false;
      for (const [a, b] of points) {
        if (a === null || b === null) { pen = false; continue; }
        if (pen) context.lineTo(x(a), y(b)); else context.moveTo(x(a), y(b));
        pen = true;
      }
      context.stroke();
      const now = points[Math.round(part * (points.length - 1))];
      if (!now || now[0] === null || now[1] === null) continue;
      context.beginPath();
      context.arc(x(now[0]), y(now[1]), 4, 0, 2 * Math.PI);
      context.fill();
    }
  }

  /* The values at the time on show. */
  tell() {
    const {clock} = this.app, part = clock.frames < 2 ? 0 : clock.frame / (clock.frames - 1);
    const at = (rows) => (rows ? (rows[Math.round(part * (rows.length - 1))] || []).map((value) => (value === null ? "–" : short(value))).join(", ") : "…");
    this.value.textContent = this.curves.map(({expression, over, rows, overRows, words}) => words || `${expression} = ${at(rows)}${unitOf(expression) && rows ? ` ${unitOf(expression)}` : ""}${over ? `, ${over} = ${at(overRows)}` : ""}`).join("  ·  ");
  }

  /* The values as a table: a column for each component. */
  csv() {
    const {clock} = this.app, found = new Map();
    for (const {expression, over, rows, overRows} of this.curves) {
      if (over && overRows) found.set(over, overRows);
      if (rows) found.set(expression, rows);
    }
    const length = Math.max(0, ...[...found.values()].map((rows) => rows.length));
    const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
    const heads = [...found].flatMap(([name, rows]) => ((rows[0] || [0]).length === 1 ? [name] : rows[0].map((_, k) => `${name}.${"xyz"[k] || k}`)));
    const lines = [["t", ...heads].map(quoted).join()];
    for (let k = 0; k < length; k += 1) {
      const time = clock.start + (length < 2 ? 0 : k / (length - 1)) * (clock.frames - 1) / clock.fps;
      lines.push([Number(time.toPrecision(12)), ...[...found.values()].flatMap((rows) => rows[k] || [null])].map((value) => (value === null ? "" : value)).join());
    }
    return `${lines.join("\n")}\n`;
  }

  save() {
    this.app.copies.download(new Blob([this.csv()], {type: "text/csv"}), `${this.app.files.stem()}.csv`);
  }
}

const short = (value) => String(Number(value.toPrecision(5)));

/* What an expression is measured in, where its last word says so. */
function unitOf(expression) {
  if (/\.angle\s*$/.test(expression)) return "°";
  return /^\s*[A-Za-z]\w*(\[\d+\])?(\.\w+)?(\.[xyl])?\s*$/.test(expression) && /\./.test(expression) ? "px" : "";
}

function unit(known) {
  const found = new Set(known.map(({expression}) => unitOf(expression)));
  return found.size === 1 ? [...found][0] : "";
}

/* Round numbers about values: the least, the most, and those between. */
function scale(values) {
  let low = values.reduce((a, b) => Math.min(a, b), Infinity), high = values.reduce((a, b) => Math.max(a, b), -Infinity);
  if (high - low < 1e-9 * (1 + Math.abs(low))) { low -= 0.5; high += 0.5; }
  const rough = (high - low) / 4, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((each) => each * power).find((each) => each >= rough);
  const first = Math.floor(low / step + 1e-9), last = Math.ceil(high / step - 1e-9);
  return [first * step, last * step, Array.from({length: last - first + 1}, (_, k) => (first + k) * step)];
}
