// SPDX-License-Identifier: Apache-2.0
// The dialog in which a curator confirms that a photo is erased for good, and says why.
import { buildDialog } from "./dialog";
import { el } from "./dom";

const WHY_LENGTH_MAX = 500; // 2000 bytes of UTF-8 at most

export class EraseForm {
  readonly element: HTMLDialogElement;
  private readonly name = el("p", { class: "name", attributes: { lang: "en", dir: "auto" } });
  private readonly why = el("input", {
    id: "erase-why",
    attributes: { type: "text", maxlength: String(WHY_LENGTH_MAX), autocomplete: "off" },
  });
  private photo = 0;

  constructor(onErase: (photo: number, why: string) => void) {
    this.element = buildDialog({
      name: "erase",
      title: "erase_title",
      send: "erase_now",
      cancel: "report_cancel",
      parts: [
        this.name,
        el("p", { words: "erase_text" }),
        el("label", { words: "erase_why", attributes: { for: "erase-why" } }),
        this.why,
      ],
      onSend: () => {
        this.element.close();
        onErase(this.photo, this.why.value);
      },
      onCancel: () => this.element.close(),
    });
  }

  ask(photo: number, name: string): void {
    this.photo = photo;
    this.name.textContent = name;
    this.why.value = "";
    this.element.showModal();
  }
}
