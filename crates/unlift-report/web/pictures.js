// Chosen images: keypoints, released records, recovered keypoints, and the graph of neighbors.
"use strict";

(() => {
  const NOT_DRAWN = 65535;
  const DARK = "#10141a";
  const GRAY = "#4a505a";
  const HIT = window.Unlift.css("--hit");
  const MISS = window.Unlift.css("--miss");
  const SHORT = "#35c46f";
  const LONG = "#ff5a4d";

  const text = (block) => document.getElementById(`block-${block}`).textContent.trim();
  const cache = new Map();

  /** Returns positions as x, y, x, y, ... in pixels; NaN if not drawn. */
  function places(picture, block) {
    if (!cache.has(block)) {
      const bytes = Uint8Array.from(atob(text(block)), (c) => c.charCodeAt(0));
      const view = new DataView(bytes.buffer);
      const points = new Float32Array(bytes.length / 2);
      for (let i = 0; i < points.length; i++) {
        const q = view.getUint16(2 * i, true);
        points[i] = q === NOT_DRAWN ? NaN : (q / (NOT_DRAWN - 1)) * picture.size[i % 2] - 0.5;
      }
      cache.set(block, points);
    }
    return cache.get(block);
  }

  const photos = new Map();

  /** Calls `ready` when the photo is loaded, or at once with null if there is none. */
  function photo(picture, ready) {
    if (picture.photo === null) return ready(null);
    const known = photos.get(picture.photo);
    if (known) return known.complete ? ready(known) : known.addEventListener("load", () => ready(known));
    const image = new Image();
    photos.set(picture.photo, image);
    image.addEventListener("load", () => ready(image));
    image.src = `data:image/jpeg;base64,${text(picture.photo)}`;
  }

  /** Prepares a canvas as wide as its parent, with coordinates in pixels of the image. */
  function open(id, picture, background) {
    const canvas = document.getElementById(id);
    const [w, h] = picture.size;
    // Limits the height of upright photos.
    const width = Math.max(1, Math.min(canvas.parentElement.clientWidth, (0.8 * window.innerHeight * w) / h));
    const height = (width * h) / w;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    canvas.style.width = `${width}px`;
    canvas.style.height = `${height}px`;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    const context = canvas.getContext("2d");
    context.fillStyle = background;
    context.fillRect(0, 0, canvas.width, canvas.height);
    const scale = canvas.width / w;
    context.setTransform(scale, 0, 0, scale, 0.5 * scale, 0.5 * scale);
    /** `pixel` is the size of a screen pixel in pixels of the image. */
    return { context, pixel: ratio / scale, w, h };
  }

  /** Draws the photo, dimmed so that marks stand out; without a photo the frame stays gray. */
  function ground({ context, w, h }, image, veil) {
    if (!image) return;
    context.drawImage(image, -0.5, -0.5, w, h);
    context.fillStyle = `rgba(16,20,26,${veil})`;
    context.fillRect(-0.5, -0.5, w, h);
  }

  function dots({ context, pixel }, points, radius, style) {
    context.fillStyle = style;
    context.beginPath();
    for (let i = 0; i < points.length; i += 2) {
      if (Number.isNaN(points[i])) continue;
      context.moveTo(points[i], points[i + 1]);
      context.arc(points[i], points[i + 1], radius * pixel, 0, 7);
    }
    context.fill();
  }

  /** Draws segments (x, y, x, y each) in one stroke. */
  function segments({ context, pixel }, ends, width, style) {
    context.strokeStyle = style;
    context.lineWidth = width * pixel;
    context.beginPath();
    for (let i = 0; i + 3 < ends.length; i += 4) {
      if (Number.isNaN(ends[i]) || Number.isNaN(ends[i + 2])) continue;
      context.moveTo(ends[i], ends[i + 1]);
      context.lineTo(ends[i + 2], ends[i + 3]);
    }
    context.stroke();
  }

  /** Returns the opacity at which `n` lines can still be told apart. */
  const opacity = (n, most) => Math.max(0.06, Math.min(most, (most * 260) / Math.max(n, 1)));

  function original(picture, image) {
    const pane = open("picture-original", picture, GRAY);
    ground(pane, image, 0.25);
    dots(pane, places(picture, picture.keypoints), 2.6, "rgba(16,20,26,0.75)");
    dots(pane, places(picture, picture.keypoints), 1.7, "#ffe08a");
  }

  function released(picture, scheme) {
    const pane = open("picture-released", picture, DARK);
    const marks = picture.released.find((one) => one.scheme === scheme);
    if (!marks) return "nothing to draw for this choice";
    const ends = places(picture, marks.block);
    if (marks.kind === "points") {
      const { w, h } = pane;
      const axes = [];
      for (let i = 0; i < ends.length; i += 2) {
        axes.push(ends[i], -0.5, ends[i], h - 0.5, -0.5, ends[i + 1], w - 0.5, ends[i + 1]);
      }
      segments(pane, axes, 1, `rgba(201,179,255,${opacity(axes.length / 4, 0.3)})`);
      dots(pane, ends, 1.8, "#e2d6ff");
      return "one point per keypoint; one of its two coordinates is wrong";
    }
    segments(pane, ends, 1, `rgba(201,179,255,${opacity(ends.length / 4, 0.55)})`);
    if (marks.kind === "lines") return "one line per keypoint";
    const anchors = ends.filter((_, i) => i % 4 < 2);
    dots(pane, anchors, 5, "#ffffff");
    return "one half-line per keypoint, from the anchor of its half of the image";
  }

  /** Draws lines from true to recovered positions, with a head if there is room. */
  function arrows(pane, ends, style) {
    const { context, pixel } = pane;
    segments(pane, ends, 1.1, style);
    context.fillStyle = style;
    context.beginPath();
    for (let i = 0; i + 3 < ends.length; i += 4) {
      const [dx, dy] = [ends[i + 2] - ends[i], ends[i + 3] - ends[i + 1]];
      const length = Math.hypot(dx, dy) / pixel;
      if (!(length > 9)) continue;
      const [ux, uy] = [(dx / length) * 6, (dy / length) * 6];
      context.moveTo(ends[i + 2], ends[i + 3]);
      context.lineTo(ends[i + 2] - ux - 0.45 * uy, ends[i + 3] - uy + 0.45 * ux);
      context.lineTo(ends[i + 2] - ux + 0.45 * uy, ends[i + 3] - uy - 0.45 * ux);
    }
    context.fill();
  }

  function recovered(picture, image, view, within) {
    const pane = open("picture-recovered", picture, GRAY);
    ground(pane, image, 0.62);
    const [truth, found] = [places(picture, picture.keypoints), places(picture, view.block)];
    const groups = { hit: [], miss: [] };
    for (let i = 0; i < truth.length; i += 2) {
      if (Number.isNaN(found[i])) continue;
      const error = Math.hypot(found[i] - truth[i], found[i + 1] - truth[i + 1]);
      groups[error <= within ? "hit" : "miss"].push(truth[i], truth[i + 1], found[i], found[i + 1]);
    }
    const heads = (ends) => ends.filter((_, i) => i % 4 > 1);
    const faint = opacity(groups.miss.length / 4, 0.75);
    arrows(pane, groups.miss, MISS + Math.round(255 * Math.max(0.3, faint)).toString(16));
    dots(pane, heads(groups.miss), 1.6, MISS);
    arrows(pane, groups.hit, HIT);
    dots(pane, heads(groups.hit), 1.9, HIT);
    return view.said;
  }

  function graph(picture, view) {
    const pane = open("picture-graph", picture, DARK);
    const drawn = picture.graphs.find((one) => one.given === view.given);
    if (!drawn) return "nothing to draw for this choice";
    const [from, to] = [places(picture, picture.keypoints), places(picture, drawn.block)];
    const edges = { short: [], long: [] };
    for (let i = 0; i < from.length / 2; i++) {
      for (let j = drawn.k * i; j < drawn.k * (i + 1); j++) {
        if (Number.isNaN(to[2 * j])) continue;
        const edge = [from[2 * i], from[2 * i + 1], to[2 * j], to[2 * j + 1]];
        const length = Math.hypot(edge[2] - edge[0], edge[3] - edge[1]);
        edges[length < picture.short_px ? "short" : "long"].push(...edge);
      }
    }
    segments(pane, edges.long, 0.8, `rgba(255,90,77,${opacity(edges.long.length / 4, 0.5)})`);
    segments(pane, edges.short, 1, SHORT);
    dots(pane, from, 1.5, "#f1efe9");
    return drawn.said;
  }

  function drawPicture(data, picture, view) {
    const within = data.thresholds[data.headline]?.value ?? 10;
    const say = (id, words) => { document.getElementById(id).textContent = words; };
    drawPicture.latest = picture;
    say("said-original", picture.photo === null ? "no photo was given" : "");
    say("said-released", released(picture, view.scheme));
    say("said-graph", graph(picture, view));
    photo(picture, (image) => {
      // Another picture may have been chosen while this photo loaded.
      if (drawPicture.latest !== picture) return;
      original(picture, image);
      say("said-recovered", `with ${view.label}, solver ${view.solver}: ${recovered(picture, image, view, within)}`);
      document.documentElement.dataset.pictures = "drawn";
    });
    say("picture-status", picture.said);
  }

  Object.assign(window.Unlift, { drawPicture });
})();
