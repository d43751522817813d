// SPDX-License-Identifier: Apache-2.0
// A dialog in which a person answers something, or leaves it.
import { el } from "./dom";
import type { WordKey } from "./words";

interface Question {
  name: string; // the heading's id is NAME-title
  title: WordKey;
  send: WordKey;
  cancel: WordKey;
  parts: Node[]; // between the heading and the buttons
  buttons?: Node[]; // after the two
  onSend: () => void; // the dialog stays open unless this closes it
  onCancel: () => void; // as by the key Escape; likewise
}

export function buildDialog(question: Question): HTMLDialogElement {
  const id = `${question.name}-title`;
  const dialog = el("dialog", { attributes: { "aria-labelledby": id } });
  const form = el("form");
  const cancel = el("button", { words: question.cancel, onClick: question.onCancel });
  const send = el("button", { class: "main", words: question.send });
  send.type = "submit";
  form.append(
    el("h2", { id, words: question.title }),
    ...question.parts,
    el("div", { class: "buttons" }, send, cancel, ...(question.buttons ?? [])),
  );
  dialog.append(form);
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    question.onSend();
  });
  dialog.addEventListener("cancel", (event) => {
    event.preventDefault();
    question.onCancel();
  });
  return dialog;
}
