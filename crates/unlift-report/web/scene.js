// The 3D view by three.js: originals, released records, and recovered points colored by error.
"use strict";

(() => {
  const THREE = window.UnliftVendor;
  const { element, length, css } = window.Unlift;
  const NOT_DRAWN = 65535;
  const BACKGROUND = "#10141a";
  /** Colors of the least and the largest error below and above the threshold. */
  const HIT = [css("--hit-least"), css("--hit-most")];
  const MISS = [css("--miss-least"), css("--miss-most")];
  /** Decades of error in the color scale on each side of the threshold. */
  const DECADES = 1.5;
  /** Field of view in degrees: a scene fits from 2.5 radii away; from a camera of the map it is as wide as a phone's. */
  const FIELD_OF_VIEW = 36;
  const CAMERA_VIEW = 65;

  const POINT_VERTEX = `
    attribute float error;
    uniform float size;
    uniform float pixels;
    varying float vError;
    varying float vDepth;
    void main() {
      vec4 view = modelViewMatrix * vec4(position, 1.0);
      gl_Position = projectionMatrix * view;
      gl_PointSize = clamp(size * pixels / -view.z, 1.4, 9.0);
      vError = error;
      vDepth = -view.z;
    }`;
  const POINT_FRAGMENT = `
    uniform vec3 flatColor;
    uniform vec3 background;
    uniform bool byError;
    uniform float near;
    uniform float far;
    uniform vec3 ramp[4];
    varying float vError;
    varying float vDepth;
    void main() {
      vec2 d = gl_PointCoord - 0.5;
      if (dot(d, d) > 0.25) discard;
      float t = clamp(vError, -1.0, 1.0);
      vec3 graded = t <= 0.0 ? mix(ramp[0], ramp[1], t + 1.0) : mix(ramp[2], ramp[3], t);
      vec3 color = byError ? graded : flatColor;
      float fade = 0.45 * clamp((vDepth - near) / (far - near), 0.0, 1.0);
      gl_FragColor = vec4(mix(color, background, fade), 1.0);
    }`;

  const rgb = (hex) => {
    const n = parseInt(hex.slice(1), 16);
    return new THREE.Vector3((n >> 16) / 255, ((n >> 8) & 255) / 255, (n & 255) / 255);
  };

  const cache = new Map();
  function bytesOf(block) {
    if (!cache.has(block)) {
      const text = atob(document.getElementById(`block-${block}`).textContent.trim());
      cache.set(block, Uint8Array.from(text, (c) => c.charCodeAt(0)));
    }
    return cache.get(block);
  }

  /** Decodes `count` positions relative to the box's center; NaN if not drawn. */
  function decode(scene, block, count) {
    const view = new DataView(bytesOf(block).buffer);
    const points = new Float32Array(3 * count);
    for (let i = 0; i < 3 * count; i++) {
      const q = view.getUint16(2 * i, true);
      const axis = i % 3;
      const half = (scene.high[axis] - scene.low[axis]) / 2;
      points[i] = q === NOT_DRAWN ? NaN : (q / (NOT_DRAWN - 1) - 0.5) * 2 * half;
    }
    return points;
  }

  /** Makes the geometry of the drawn points, with errors from -1 to 1 around the threshold. */
  function geometryOfPoints(points, errorBytes) {
    const kept = [];
    const errors = [];
    for (let i = 0; i < points.length / 3; i++) {
      if (Number.isNaN(points[3 * i])) continue;
      kept.push(points[3 * i], points[3 * i + 1], points[3 * i + 2]);
      errors.push(errorBytes ? ((errorBytes[i] / 254 - 0.5) * 6) / DECADES : 0);
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(kept), 3));
    geometry.setAttribute("error", new THREE.BufferAttribute(new Float32Array(errors), 1));
    return geometry;
  }

  /** Makes line segments from records of `corners` points each. */
  function geometryOfLines(points, corners) {
    const kept = [];
    const push = (i) => kept.push(points[3 * i], points[3 * i + 1], points[3 * i + 2]);
    for (let i = 0; i + corners <= points.length / 3; i += corners) {
      if (points.subarray(3 * i, 3 * (i + corners)).some(Number.isNaN)) continue;
      const edges = corners === 2 ? 1 : corners;
      for (let e = 0; e < edges; e++) {
        push(i + e);
        push(i + ((e + 1) % corners));
      }
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(kept), 3));
    return geometry;
  }

  class SceneView {
    constructor(canvas, data) {
      this.canvas = canvas;
      this.data = data.scene;
      this.schemes = data.schemes;
      this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
      this.renderer.setClearColor(BACKGROUND);
      this.renderer.setScissorTest(true);
      const { low, high, middle, up } = this.data;
      const fromCenter = (place) => place.map((x, i) => x - (low[i] + high[i]) / 2);
      this.radius = 0.5 * Math.hypot(...low.map((x, i) => high[i] - x));
      this.scene = new THREE.Scene();
      const { eye } = this.data;
      this.fov = eye ? CAMERA_VIEW : FIELD_OF_VIEW;
      this.camera = new THREE.PerspectiveCamera(this.fov, 1, this.radius / 200, this.radius * 30);
      this.up = new THREE.Vector3(...up).normalize();
      this.camera.up.copy(this.up);
      // The view starts in any direction across `up`, slightly above the horizon.
      const across = Math.abs(up[0]) < 0.8 * Math.hypot(...up) ? new THREE.Vector3(1, 0.35, 0) : new THREE.Vector3(0.35, 0, 1);
      across.addScaledVector(this.up, -across.dot(this.up)).normalize();
      this.camera.position.copy(across).addScaledVector(this.up, 0.55).normalize().multiplyScalar(this.radius * 2.5).add(new THREE.Vector3(...fromCenter(middle)));
      // From the place of a camera, the map resembles the photo.
      if (eye) this.camera.position.set(...fromCenter(eye));
      this.controls = new THREE.OrbitControls(this.camera, canvas);
      // Half of the points lie on either side of the target; the box may reach far beyond them.
      this.controls.target.set(...fromCenter(middle));
      this.controls.update();
      this.controls.enableZoom = false;
      this.controls.addEventListener("change", () => this.render());
      // The wheel scrolls the page until the view has focus.
      canvas.addEventListener("pointerdown", () => { canvas.focus({ preventScroll: true }); });
      canvas.addEventListener("focus", () => { this.controls.enableZoom = true; });
      canvas.addEventListener("blur", () => { this.controls.enableZoom = false; });
      canvas.addEventListener("keydown", (event) => this.key(event));
      this.layers = new Map();
      this.panes = [];
      new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    }

    pointsMaterial(flatColor, byError, size = 0.013) {
      return new THREE.ShaderMaterial({
        vertexShader: POINT_VERTEX,
        fragmentShader: POINT_FRAGMENT,
        uniforms: {
          size: { value: size * this.radius },
          pixels: { value: 500 },
          flatColor: { value: rgb(flatColor) },
          background: { value: rgb(BACKGROUND) },
          byError: { value: byError },
          near: { value: this.radius * 2 },
          far: { value: this.radius * 4 },
          ramp: { value: [...HIT, ...MISS].map(rgb) },
        },
      });
    }

    /** Returns a layer by name; it is decoded on first use. */
    layer(name, make) {
      if (!this.layers.has(name)) {
        const layer = make();
        this.layers.set(name, layer);
        this.scene.add(layer.object);
      }
      return this.layers.get(name);
    }

    points(name, block, count, flat, withErrors, size) {
      return this.layer(name, () => {
        const errors = withErrors ? bytesOf(block).subarray(6 * count, 7 * count) : null;
        const geometry = geometryOfPoints(decode(this.data, block, count), errors);
        return { object: new THREE.Points(geometry, this.pointsMaterial(flat, withErrors, size)) };
      });
    }

    original() {
      return this.points("original", 0, this.data.n_drawn, "#f1e9d8", false);
    }

    cameras() {
      return this.points("cameras", 1, this.data.n_cameras, "#7ee0a8", false, 0.02);
    }

    obfuscated(scheme) {
      const entry = this.data.obfuscations.find((o) => o.scheme === scheme);
      if (!entry) return null;
      if (entry.kind === "points") return this.points(`released ${scheme}`, entry.block, entry.count, "#c9b3ff", false);
      return this.layer(`released ${scheme}`, () => {
        const corners = entry.kind === "segments" ? 2 : 4;
        const geometry = geometryOfLines(decode(this.data, entry.block, corners * entry.count), corners);
        const material = new THREE.LineBasicMaterial({ color: "#c9b3ff", transparent: true, opacity: 0.15, depthWrite: false });
        return { object: new THREE.LineSegments(geometry, material) };
      });
    }

    recovered({ block }) {
      return this.points(`view ${block}`, block, this.data.n_drawn, "#ffffff", true);
    }

    /**
     * Shows the panes `kinds` of `view` of a scheme, with or without cameras. Returns the panes, each with a
     * sentence on what it draws.
     */
    show({ kinds, scheme, view, cameras }) {
      const made = {
        original: () => ({ layer: this.original(), said: this.data.originals_said, name: "original" }),
        released: () => {
          const entry = this.data.obfuscations.find((one) => one.scheme === scheme);
          return { layer: this.obfuscated(scheme), said: entry?.said ?? "nothing to draw", name: `released, ${scheme}` };
        },
        recovered: () => ({ layer: this.recovered(view), said: view.said, name: `recovered, ${view.label}` }),
      };
      this.panes = kinds.map((kind) => ({ kind, ...made[kind]() }));
      this.extra = cameras && this.data.n_cameras ? [this.cameras()] : [];
      this.resize();
      return this.panes;
    }

    resize() {
      const { clientWidth, clientHeight } = this.canvas.parentElement;
      if (!clientWidth || !clientHeight) return;
      this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
      this.renderer.setSize(clientWidth, clientHeight, false);
      this.render();
    }

    render() {
      const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
      const wide = width >= 620 || this.panes.length === 1;
      this.panes.forEach((pane, index) => {
        for (const { object } of this.layers.values()) object.visible = false;
        for (const shown of [pane.layer, ...this.extra]) if (shown) shown.object.visible = true;
        const w = wide ? width / this.panes.length : width;
        const h = wide ? height : height / this.panes.length;
        const [x, y] = wide ? [index * w, 0] : [0, (this.panes.length - 1 - index) * h];
        this.camera.aspect = w / h;
        // In a narrow pane the width decides whether the scene fits.
        const half = Math.tan((this.fov * Math.PI) / 360) / Math.min(1, this.camera.aspect);
        this.camera.fov = (Math.atan(half) * 360) / Math.PI;
        this.camera.updateProjectionMatrix();
        const distance = this.camera.position.distanceTo(this.controls.target);
        for (const { object } of this.layers.values()) {
          const uniforms = object.material.uniforms;
          if (!uniforms) continue;
          uniforms.pixels.value = (this.renderer.getPixelRatio() * h) / (2 * Math.tan((this.camera.fov * Math.PI) / 360));
          uniforms.near.value = Math.max(0, distance - this.radius);
          uniforms.far.value = distance + this.radius;
        }
        this.renderer.setViewport(x, y, w, h);
        this.renderer.setScissor(x, y, w, h);
        this.renderer.render(this.scene, this.camera);
      });
    }

    key(event) {
      const offset = this.camera.position.clone().sub(this.controls.target);
      const side = this.up.clone().cross(offset).normalize();
      const turn = { ArrowLeft: [this.up, -0.12], ArrowRight: [this.up, 0.12], ArrowUp: [side, -0.12], ArrowDown: [side, 0.12] }[event.key];
      const zoom = { "+": 0.9, "=": 0.9, "-": 1 / 0.9 }[event.key];
      if (turn) {
        const moved = offset.clone().applyAxisAngle(...turn);
        // The view stops at the pole, where left and right would swap.
        if (moved.angleTo(this.up) > 0.05 && moved.angleTo(this.up) < Math.PI - 0.05) offset.copy(moved);
      } else if (zoom) {
        offset.multiplyScalar(zoom);
      } else {
        return;
      }
      event.preventDefault();
      this.camera.position.copy(this.controls.target).add(offset);
      this.controls.update();
      this.render();
    }
  }

  function ramp(node, scene, unit) {
    const bar = element("i", { style: `background:linear-gradient(90deg,${HIT[0]},${HIT[1]} 50%,${MISS[0]} 50%,${MISS[1]})` });
    const at = (factor) => length(scene.error_unit * factor, unit);
    const reach = 10 ** DECADES;
    const ticks = element("span", { class: "ticks" });
    ticks.append(...[`≤ ${at(1 / reach)}`, at(1), `≥ ${at(reach)}`].map((text) => element("span", {}, text)));
    node.replaceChildren(element("span", {}, `Error of a recovered point: blue within ${at(1)}, orange beyond`), bar, ticks);
  }

  Object.assign(window.Unlift, { SceneView, ramp });
})();
