// SPDX-License-Identifier: Apache-2.0
// How many points a frame draws, by how long the frames before took: many in one with a graphics
// card, few in one without.
const COUNT_FIRST = 500_000;
// So many are drawn whatever else takes how long, while the view moves and while it is still.
const MOVING_COUNT_MIN = 50_000;
const STILL_COUNT_MIN = 500_000;
// So long a frame may take while the view moves, and while it is still. Chosen by hand: at 20
// frames a second one still sees what one does, and a still view must not keep one waiting.
const MOVING_MS = 50;
const STILL_MS = 1_000;
const LOOK_MS = 4; // how often it looks whether a frame is done

export class PointPace {
  private pointsOfMs = COUNT_FIRST / MOVING_MS;
  private isMeasuring = false;

  constructor(private readonly gl: WebGL2RenderingContext) {}

  // A frame is being drawn still.
  get isPending(): boolean {
    return this.isMeasuring;
  }

  countMax(isMoving: boolean): number {
    return isMoving
      ? Math.max(MOVING_COUNT_MIN, this.pointsOfMs * MOVING_MS)
      : Math.max(STILL_COUNT_MIN, this.pointsOfMs * STILL_MS);
  }

  // After the commands of a frame that draws `count` points and began at `began`, by
  // performance.now(). Whatever else it draws counts as if it were points. Few points say little.
  measure(count: number, began: number): void {
    if (this.isMeasuring || count < MOVING_COUNT_MIN) return;
    const { gl } = this;
    const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    if (!fence) return;
    gl.flush();
    this.isMeasuring = true;
    const look = () => {
      const isDone = gl.getSyncParameter(fence, gl.SYNC_STATUS) === gl.SIGNALED;
      if (!isDone && !gl.isContextLost()) {
        window.setTimeout(look, LOOK_MS);
        return;
      }
      gl.deleteSync(fence);
      this.isMeasuring = false;
      if (isDone) this.learn(count / Math.max(1, performance.now() - began));
    };
    window.setTimeout(look, LOOK_MS);
  }

  // The mean in logarithms, so that one slow frame does not count for many.
  private learn(pointsOfMs: number): void {
    this.pointsOfMs = Math.sqrt(this.pointsOfMs * pointsOfMs);
  }
}
