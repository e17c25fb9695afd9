/* In a notebook, the page of the studio talks with the cell around it and not with a server. */
(() => {
  const Address = window.URL;
  window.URL = class extends Address {
    constructor(url, base) { super(url, base === window.location.href ? "http://notebook/" : base); }
  };
  window.WebSocket = class extends EventTarget {
    static OPEN = 1;
    constructor() {
      super();
      this.readyState = 0;
      window.addEventListener("message", (event) => {
        if (event.source !== window.parent || typeof event.data !== "string") return;
        if (this.readyState === 0) {
          this.readyState = 1;
          this.dispatchEvent(new Event("open"));
        }
        this.dispatchEvent(new MessageEvent("message", {data: event.data}));
      });
      window.parent.postMessage({movimentum: "open"}, "*");
    }
    send(data) { window.parent.postMessage({movimentum: "message", data}, "*"); }
    close() {}
  };
  /* Python has the text: nothing is lost when the page is left, and nothing is to be found again. */
  const listen = window.addEventListener.bind(window);
  window.addEventListener = (kind, ...more) => { if (kind !== "beforeunload") listen(kind, ...more); };
  Object.defineProperty(window, "sessionStorage", {value: {getItem: () => null, setItem() {}, removeItem() {}}});
})();
