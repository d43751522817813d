// SPDX-License-Identifier: Apache-2.0
// The dialog in which a curator confirms that a photo is erased for good, and says why.
import { el } from "./dom";

const WHY_LENGTH_MAX = 500; // 2000 bytes of UTF-8 at most

export class EraseForm {
  readonly element = el("dialog", { attributes: { "aria-labelledby": "erase-title" } });
  private readonly name = el("p", { class: "name", attributes: { lang: "en", dir: "auto" } });
  private readonly why = el("input", {
    id: "erase-why",
    attributes: { type: "text", maxlength: String(WHY_LENGTH_MAX), autocomplete: "off" },
  });
  private photo = 0;

  constructor(private readonly onErase: (photo: number, why: string) => void) {
    const form = el("form");
    const cancel = el("button", { words: "report_cancel" });
    const erase = el("button", { class: "main", words: "erase_now" });
    erase.type = "submit";
    form.append(
      el("h2", { id: "erase-title", words: "erase_title" }),
      this.name,
      el("p", { words: "erase_text" }),
      el("label", { words: "erase_why", attributes: { for: "erase-why" } }),
      this.why,
      el("div", { class: "buttons" }, cancel, erase),
    );
    this.element.append(form);
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.element.close();
      this.onErase(this.photo, this.why.value);
    });
    cancel.addEventListener("click", () => this.element.close());
  }

  ask(photo: number, name: string): void {
    this.photo = photo;
    this.name.textContent = name;
    this.why.value = "";
    this.element.showModal();
  }
}
