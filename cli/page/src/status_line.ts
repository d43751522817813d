// SPDX-License-Identifier: Apache-2.0
// One line that tells what went wrong or what is new. A lost connection stays until it is back.
import { ConnectionLost, Problem } from "./api";
import { el } from "./dom";
import { t } from "./words";

const SHOWN_MS = 10_000;

export class StatusLine {
  readonly element = el("p", {
    id: "status",
    class: "status",
    attributes: { role: "status", "aria-live": "polite" },
  });
  private isLost = false;
  private waiting = ""; // what was told meanwhile
  private timer = 0;

  // A text that goes by itself. Where the connection is lost it waits until that is back.
  tell(text: string): void {
    if (this.isLost) {
      this.waiting = text;
      return;
    }
    this.set(text);
    this.timer = window.setTimeout(() => this.set(""), SHOWN_MS);
  }

  tellError(error: unknown): void {
    if (error instanceof ConnectionLost) return this.lose();
    if (error instanceof Problem && error.status === 401) return this.tell(t("status_token"));
    const detail = error instanceof Error ? error.message : String(error);
    this.tell(t("status_error", { detail }));
  }

  lose(): void {
    this.isLost = true;
    this.set(t("status_lost"));
  }

  // Something was answered.
  regain(): void {
    if (!this.isLost) return;
    this.isLost = false;
    this.tell(this.waiting || t("status_back"));
    this.waiting = "";
  }

  private set(text: string): void {
    clearTimeout(this.timer);
    // A text that is set again is read aloud again.
    if (this.element.textContent !== text) this.element.textContent = text;
  }
}
