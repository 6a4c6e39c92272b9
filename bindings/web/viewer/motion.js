// How the view moves: the orbit that is shown glides to its goal.
import { approached, isAtEnd, panned, wholeDistance, within } from "./orbit.js";

const GLIDE = 70; // ms: time constant
const TURN = Math.PI; // radians of a drag as long as the picture is high

export class Motion {
    // The orbit of the default camera: the very object stands for that camera, which is exact.
    framed;
    aspect; // of the picture: width / height
    orbit; // that is shown
    goal;
    #stage;
    #isReduced;
    #changed = false;

    // `isReduced()`: whether the user wants no smooth motion.
    constructor(stage, framed, aspect, isReduced) {
        this.#stage = stage;
        this.#isReduced = isReduced;
        this.framed = this.orbit = this.goal = framed;
        this.aspect = aspect;
    }

    go(goal, smooth) {
        if (goal === this.goal && goal === this.orbit) return;
        this.goal = goal === this.framed ? goal : within(goal, this.#stage);
        if (!smooth || this.#isReduced()) this.orbit = this.goal;
        this.#changed = true;
    }

    // The picture has another shape: as much of the model as before stays in view.
    reframe(framed, aspect) {
        const { viewAngle } = this.goal;
        const factor =
            wholeDistance(viewAngle, this.#stage, aspect) / wholeDistance(viewAngle, this.#stage, this.aspect);
        const isFramed = this.goal === this.framed;
        this.framed = framed;
        this.aspect = aspect;
        this.go(isFramed ? framed : { ...this.goal, radius: this.goal.radius * factor }, false);
    }

    // Lengths are picture heights.
    turn(right, down, smooth) {
        const { theta, phi } = this.goal;
        this.go({ ...this.goal, theta: theta - right * TURN, phi: phi - down * TURN }, smooth);
    }

    pan(right, down, smooth) {
        this.go(panned(this.goal, right, down, this.#stage), smooth);
    }

    // `point`: what to come near to, so that no zoom leads through the surface; null: the target.
    zoom(factor, smooth, point) {
        const goal = point && factor > 1 ? approached(this.goal, point, factor, this.#stage) : null;
        this.go(goal ?? { ...this.goal, radius: this.goal.radius / factor }, smooth);
    }

    // Whether the view can become so many times as large.
    canZoom(factor) {
        return !isAtEnd(this.goal, factor, this.#stage);
    }

    // The same view, seen after `angle` radians about the model's up axis.
    rotate(angle) {
        this.orbit = { ...this.orbit, theta: this.orbit.theta + angle };
        this.goal = { ...this.goal, theta: this.goal.theta + angle };
        this.#changed = true;
    }

    // Moves on by `passed` ms. Returns whether the view changed.
    step(passed) {
        const changed = this.#changed || this.orbit !== this.goal;
        this.#changed = false;
        if (this.orbit !== this.goal) {
            const next = between(this.orbit, this.goal, 1 - Math.exp(-passed / GLIDE));
            this.orbit = isNear(next, this.goal) ? this.goal : next;
        }
        return changed;
    }
}

// The part 0..1 of the way from one orbit to another.
function between(from, to, part) {
    const mix = (a, b) => a + (b - a) * part;
    return {
        theta: mix(from.theta, to.theta),
        phi: mix(from.phi, to.phi),
        radius: from.radius * (to.radius / from.radius) ** part,
        target: from.target.map((x, i) => mix(x, to.target[i])),
        viewAngle: mix(from.viewAngle, to.viewAngle),
    };
}

// Whether pictures of 1000 rows hardly differ.
function isNear(a, b) {
    return (
        Math.abs(a.theta - b.theta) < 1e-3 &&
        Math.abs(a.phi - b.phi) < 1e-3 &&
        Math.abs(a.radius / b.radius - 1) < 1e-3 &&
        Math.abs(a.viewAngle - b.viewAngle) < 1e-3 &&
        Math.hypot(...a.target.map((x, i) => x - b.target[i])) < 1e-3 * b.radius
    );
}
