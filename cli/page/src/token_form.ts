// SPDX-License-Identifier: Apache-2.0
// A small form that asks for a token.
import { buildDialog } from "./dialog";
import { el, foreign } from "./dom";

export class TokenForm {
  readonly element: HTMLDialogElement;
  private readonly input = el("input", {
    id: "token",
    attributes: { type: "password", autocomplete: "off", spellcheck: "false", required: "" },
  });
  private readonly detail = el("p", { class: "quiet", attributes: { role: "status" } });
  private readonly forgetButton = el("button", { words: "token_forget" });
  private answer: (token: string | null) => void = () => {};

  constructor(onForget: () => void) {
    this.element = buildDialog({
      name: "token",
      title: "token_title",
      send: "token_enter",
      cancel: "token_cancel",
      parts: [
        el("p", { words: "token_text" }),
        this.detail,
        el("label", { words: "token_label", attributes: { for: "token" } }),
        this.input,
      ],
      buttons: [this.forgetButton],
      onSend: () => {
        // No token has spaces or other characters than these, which a copy may bring along. A
        // header could not carry all of them.
        const token = this.input.value.replace(/[^!-~]/g, "");
        if (token !== "") this.close(token);
      },
      onCancel: () => this.close(null),
    });
    this.forgetButton.addEventListener("click", onForget);
  }

  // Null: the person has none. `detail`: the daemon's words, or "".
  ask(hasToken: boolean, detail: string): Promise<string | null> {
    this.detail.replaceChildren(foreign(detail));
    this.forgetButton.hidden = !hasToken;
    this.input.value = "";
    if (!this.element.open) this.element.showModal();
    return new Promise((resolve) => (this.answer = resolve));
  }

  private close(token: string | null): void {
    this.element.close();
    this.input.value = "";
    this.answer(token);
  }
}
