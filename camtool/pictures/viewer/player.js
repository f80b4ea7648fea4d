// Play, pause, the slider and the clock.

const SLIDER_STEPS = 10000;
const WHOLE_SECONDS = 20;
const WAITED_MS = 250;

class Player {
  constructor(run, moved) {
    this.run = run;
    this.moved = moved;
    this.playing = false;
    this.slider = find("slider");
    this.slider.max = String(SLIDER_STEPS);
    this.slider.addEventListener("input", () => {
      const share = Number(this.slider.value) / SLIDER_STEPS;
      if (share >= 1) this.run.toEnd();
      else this.run.toTime(share * this.run.total);
      this.show();
    });
    find("play").addEventListener("click", () => this.toggle());
    this.show();
  }

  /** Seconds of the machine for one of ours. */
  get speed() {
    const chosen = find("speed").value;
    return chosen === "whole" ? this.run.total / WHOLE_SECONDS : Number(chosen);
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  play() {
    if (this.run.isAtEnd) this.run.toStart();
    this.playing = true;
    this.then = performance.now();
    this.label();
    requestAnimationFrame((now) => this.step(now));
  }

  pause() {
    this.playing = false;
    this.label();
  }

  label() {
    find("play").textContent = this.playing ? "Pause" : "Play";
    find("play").setAttribute("aria-pressed", String(this.playing));
  }

  step(now) {
    if (!this.playing) return;
    // A page that slept goes on from where it was.
    const passed = Math.min(WAITED_MS, Math.max(0, now - this.then)) / 1000;
    this.then = now;
    const time = this.run.time + passed * this.speed;
    if (time >= this.run.total) {
      this.run.toEnd();
      this.pause();
    } else this.run.toTime(time);
    this.show();
    if (this.playing) requestAnimationFrame((next) => this.step(next));
  }

  toRow(row) {
    this.pause();
    this.run.toRow(row);
    this.show();
  }

  toStart() {
    this.pause();
    this.run.toStart();
    this.show();
  }

  faster(way) {
    const speed = find("speed"), next = speed.selectedIndex + way;
    speed.selectedIndex = Math.min(speed.options.length - 1, Math.max(0, next));
  }

  show() {
    const { run } = this, share = run.total ? run.time / run.total : 1;
    this.slider.value = String(Math.round(share * SLIDER_STEPS));
    this.slider.setAttribute("aria-valuetext", `${clock(run.time)}, move ${run.row + 1}`);
    find("clock").textContent = `${clock(run.time)} of ${clock(run.total)}`;
    this.moved();
  }
}
