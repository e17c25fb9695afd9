// Starts `movimentum lsp`, and shows the film that it renders. Everything else is the server's.
const vscode = require("vscode");
const {LanguageClient, State} = require("vscode-languageclient/node");

let client = null;

async function start() {
  const [command, ...args] = vscode.workspace.getConfiguration("movimentum").get("command");
  const server = {command, args};
  const options = {
    documentSelector: [{language: "movimentum"}],
    synchronize: {fileEvents: vscode.workspace.createFileSystemWatcher("**/*.mov")},
  };
  client = new LanguageClient("movimentum", "Movimentum", server, options);
  try {
    await client.start();
  } catch (problem) {
    const choice = await vscode.window.showErrorMessage(
      `Movimentum: \`${[command, ...args].join(" ")}\` cannot be started. Install it with: pip install 'movimentum[lsp]'`,
      "Open the Settings",
    );
    if (choice) vscode.commands.executeCommand("workbench.action.openSettings", "movimentum.command");
  }
}

async function showFilm() {
  const editor = vscode.window.activeTextEditor;
  if (!editor || !client || client.state !== State.Running) return;
  const uri = editor.document.uri.toString();
  const made = await vscode.window.withProgress(
    {location: vscode.ProgressLocation.Window, title: "Movimentum renders"},
    () => client.sendRequest("workspace/executeCommand", {command: "movimentum.showPicture", arguments: [uri]}),
  );
  if (made.error) vscode.window.showErrorMessage(`Movimentum: ${made.error}`);
  else vscode.commands.executeCommand("vscode.open", vscode.Uri.parse(made.uri), vscode.ViewColumn.Beside);
}

async function activate(context) {
  context.subscriptions.push(
    vscode.commands.registerCommand("movimentum.showFilm", showFilm),
    vscode.commands.registerCommand("movimentum.restart", async () => {
      if (client) await client.dispose();
      await start();
    }),
  );
  await start();
}

async function deactivate() {
  if (client) await client.dispose();
}

module.exports = {activate, deactivate};
