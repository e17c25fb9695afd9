/* Offsets: the server counts characters (code points), the editor UTF-16 units. */
export class Places {
  constructor(text) {
    this.length = text.length;
    this.starts = null;
    if (!/[\ud800-\udbff][\udc00-\udfff]/.test(text)) return;
    this.starts = [];
    for (let k = 0; k < text.length; k += 1) {
      this.starts.push(k);
      const unit = text.charCodeAt(k);
      const next = text.charCodeAt(k + 1);
      if (unit >= 0xd800 && unit < 0xdc00 && next >= 0xdc00 && next < 0xe000) k += 1;
    }
    this.starts.push(text.length);
  }

  /* The editor's offset of the server's. */
  unit(character) {
    const k = Math.max(0, character);
    if (this.starts === null) return Math.min(k, this.length);
    return k < this.starts.length ? this.starts[k] : this.length;
  }

  /* The server's offset of the editor's. */
  character(unit) {
    if (this.starts === null) return Math.min(unit, this.length);
    let low = 0, high = this.starts.length - 1;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.starts[middle] < unit) low = middle + 1; else high = middle;
    }
    return low;
  }

  span([from, to]) {
    return [this.unit(from), this.unit(to)];
  }
}
