/* The socket to the server; it comes back by itself. */
export class Link {
  constructor(url, {message, state}) {
    this.url = url;
    this.told = {message, state};
    this.waiting = 250;
    this.open();
  }

  open() {
    this.socket = new WebSocket(this.url);
    this.socket.addEventListener("open", () => { this.waiting = 250; this.told.state(true); });
    this.socket.addEventListener("message", (event) => this.told.message(JSON.parse(event.data)));
    this.socket.addEventListener("close", () => {
      this.told.state(false);
      setTimeout(() => this.open(), this.waiting);
      this.waiting = Math.min(3000, 1.5 * this.waiting);
    });
  }

  get ready() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  send(message) {
    if (this.ready) this.socket.send(JSON.stringify(message));
    return this.ready;
  }
}
