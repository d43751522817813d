// SPDX-License-Identifier: Apache-2.0
// What the page knows of the city. It reads everything anew when the journal tells of a change.
import type { CameraModel, Georeference, Hypothesis, Photo, Reconstruction } from "./answers";
import type { Api } from "./api";

// The daemon gives at most so many photos at once (docs/serving.md).
const PAGE_COUNT = 1000;
const PAUSE_MS_MIN = 3_000;
// A reading may take very long, where it waits for a person to give a token.
const PAUSE_MS_MAX = 60_000;
const FAILED_PAUSE_MS_MAX = 15_000;

export class City {
  photos: Photo[] = [];
  byId = new Map<number, Photo>();
  reconstructions: Reconstruction[] = [];
  hypotheses: Hypothesis[] = [];
  cameras: CameraModel[] = [];
  georeference: Georeference = { reconstructions: [] };

  private readonly listeners: (() => void | Promise<void>)[] = [];
  private timer: number | null = null;
  private reading = false;
  private stale = false;
  private finished = -Infinity; // when the last reading ended, by performance.now()
  private pauseMs = PAUSE_MS_MIN;

  // `onError` is told of each reading that failed; it is tried again after the pause.
  constructor(
    private readonly api: Api,
    private readonly onError: (error: unknown) => void,
    private readonly onRead: () => void,
  ) {}

  // `listener` is called after each reading. What it gives is waited for: what it asks the daemon
  // for is a part of the reading.
  onChange(listener: () => void | Promise<void>): void {
    this.listeners.push(listener);
  }

  // Reads everything soon, but at most once in three seconds, and in a large city no more than a
  // fifth of the time. The pause grows with each reading that fails.
  readSoon(): void {
    this.stale = true;
    if (this.timer !== null || this.reading) return;
    const wait = Math.max(0, this.finished + this.pauseMs - performance.now());
    this.timer = window.setTimeout(() => void this.readNow(), wait);
  }

  private async readNow(): Promise<void> {
    this.timer = null;
    this.reading = true;
    this.stale = false;
    const began = performance.now();
    let isDone = false;
    try {
      const answers = [
        this.readPhotos(),
        this.api.jsonIfChanged<Reconstruction[]>("/v1/reconstructions"),
        this.api.jsonIfChanged<Hypothesis[]>("/v1/hypotheses"),
        this.api.jsonIfChanged<CameraModel[]>("/v1/cameras"),
        this.api.jsonIfChanged<Georeference>("/v1/georeference"),
      ] as const;
      // Where one of them fails, the others end before the next reading begins.
      await Promise.allSettled(answers);
      const [photos, reconstructions, hypotheses, cameras, georeference] =
        await Promise.all(answers);
      this.photos = photos;
      this.byId = new Map(photos.map((photo) => [photo.id, photo]));
      this.reconstructions = reconstructions;
      this.hypotheses = hypotheses;
      this.cameras = cameras;
      this.georeference = georeference;
      this.onRead();
      await Promise.all(this.listeners.map((listener) => listener()));
      isDone = true;
    } catch (error) {
      this.stale = true;
      this.onError(error);
    }
    this.reading = false;
    this.finished = performance.now();
    const took = this.finished - began;
    this.pauseMs = isDone
      ? Math.min(Math.max(PAUSE_MS_MIN, 4 * took), PAUSE_MS_MAX)
      : Math.min(2 * this.pauseMs, FAILED_PAUSE_MS_MAX);
    if (this.stale) this.readSoon();
  }

  private async readPhotos(): Promise<Photo[]> {
    const photos: Photo[] = [];
    for (let from = 1; ; ) {
      const path = `/v1/photos?from=${from}&count=${PAGE_COUNT}`;
      const page = await this.api.jsonIfChanged<Photo[]>(path);
      photos.push(...page);
      const last = page.at(-1);
      if (!last || page.length < PAGE_COUNT) return photos;
      from = last.id + 1;
    }
  }
}
