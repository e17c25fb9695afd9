/* The studio as a widget (anywidget): a frame with the studio's page, and what passes between it and Python. */
function render({model, el}) {
  const view = `${Date.now()}-${Math.random()}`;
  const frame = document.createElement("iframe");
  frame.title = "Movimentum Studio";
  frame.dataset.testid = "studio";
  frame.style.cssText = `width: 100%; height: ${model.get("height")}px; border: 1px solid #8886; box-sizing: border-box`;
  const fromPage = (event) => {
    if (event.source === frame.contentWindow && event.data && event.data.movimentum) model.send({view, ...event.data});
  };
  const fromPython = (message) => {
    if (message.view !== view) return;
    if (message.page) frame.srcdoc = message.page;
    else if (frame.contentWindow) frame.contentWindow.postMessage(message.data, "*");
  };
  window.addEventListener("message", fromPage);
  model.on("msg:custom", fromPython);
  el.append(frame);
  model.send({view, movimentum: "page"});
  return () => {
    window.removeEventListener("message", fromPage);
    model.off("msg:custom", fromPython);
    model.send({view, movimentum: "closed"});
  };
}

export default {render};
