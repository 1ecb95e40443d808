"use strict";
(function () {
  const byId = (id) => document.getElementById(id);
  const data = JSON.parse(byId("data").textContent);
  const panel = byId("panel"), slider = byId("time"), clock = byId("clock"), button = byId("play");
  const narrow = () => window.innerWidth < 700;
  if (narrow()) byId("numbers").open = false;

  let viewer;
  try {
    viewer = new MeshCat.Viewer(byId("meshcat-pane"));
  } catch (error) {
    byId("failure").textContent = "This browser shows no 3D graphics (WebGL): switch hardware acceleration on, or take another.";
    byId("failure").hidden = false;
    throw error;
  }
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  for (const command of byId("commands").textContent.trim().split(/\s+/)) viewer.handle_command_bytearray(bytes(command));
  const THREE = MeshCat.THREE, animator = viewer.animator, camera = viewer.camera;
  animator.mixer.timeScale = data.speed;

  // MeshCat's scene has z up, three.js y.
  const point = (xyz) => new THREE.Vector3(xyz[0], xyz[2], -xyz[1]);

  // The camera: as near as everything stays in sight.
  const SIDES = { front: [1, 0, 0.02], side: [0, -1, 0.02], top: [0.001, 0, 1], all: data.direction };
  function frame(direction = data.direction) {
    const whole = direction === data.direction;  // from straight aside the floor far below is left out
    const all = data.framed.concat(whole ? data.feet : []).map(point), away = point(direction).normalize();
    const target = new THREE.Box3().setFromPoints(all).getCenter(new THREE.Vector3());
    const room = { left: narrow() ? -0.95 : -0.95 + 2 * Math.min(0.4, 270 / window.innerWidth), right: 0.95, low: narrow() ? -0.68 : -0.84, high: narrow() ? 0.5 : 0.94 };
    const place = (distance) => {
      camera.position.copy(target).addScaledVector(away, distance);
      camera.up.set(0, 1, 0);
      camera.lookAt(target);
      camera.updateMatrixWorld();
    };
    const seen = () => {
      const box = new THREE.Box2(), spot = new THREE.Vector3();
      for (const corner of all) {
        spot.copy(corner).project(camera);
        box.expandByPoint(new THREE.Vector2(spot.x, spot.y));
      }
      return box;
    };
    camera.fov = 35;
    camera.aspect = window.innerWidth / window.innerHeight;
    camera.updateProjectionMatrix();
    let distance = 3 * new THREE.Box3().setFromPoints(all).getSize(new THREE.Vector3()).length();
    for (let i = 0; i < 30; i++) {
      place(distance);
      const box = seen(), reach = distance * Math.tan((camera.fov * Math.PI) / 360);
      const x = (box.min.x + box.max.x - room.left - room.right) / 2, y = (box.min.y + box.max.y - room.low - room.high) / 2;
      const right = new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 0);
      const up = new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 1);
      target.addScaledVector(right, x * reach * camera.aspect).addScaledVector(up, y * reach);
      const share = Math.max((box.max.x - box.min.x) / (room.right - room.left), (box.max.y - box.min.y) / (room.high - room.low));
      distance = Math.min(50, Math.max(0.2, distance * Math.min(2, Math.max(0.5, share))));
    }
    place(distance);
    viewer.controls.target.copy(target);
    viewer.set_dirty();
  }
  frame();
  let touched = false;  // from then on the view is the user's
  viewer.controls.addEventListener("start", () => { touched = true; });
  window.addEventListener("resize", () => { if (!touched) frame(); });
  for (const each of document.querySelectorAll("#views button")) {
    each.addEventListener("click", () => { touched = true; frame(SIDES[each.dataset.view]); });
  }

  // Texts in the scene.
  const texts = data.labels.map((label) => {
    const element = document.createElement("span");
    element.textContent = label.text;
    element.className = label.kind;
    element.style.color = label.colour;
    byId("labels").appendChild(element);
    return { element, place: point(label.place) };
  });
  function moveTexts() {
    const spot = new THREE.Vector3();
    for (const { element, place } of texts) {
      spot.copy(place).project(camera);
      const x = ((spot.x + 1) / 2) * window.innerWidth, y = ((1 - spot.y) / 2) * window.innerHeight;
      element.style.transform = `translate(-50%, -50%) translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
      element.hidden = spot.z > 1;
    }
  }

  // The distances in numbers.
  const cells = [];
  function row(parent, head, count) {
    const line = parent.insertRow(), title = document.createElement("th");
    title.textContent = head;
    line.appendChild(title);
    return Array.from({ length: count }, () => line.insertCell());
  }
  for (const design of data.designs) {
    const body = byId("distances").createTBody();
    if (data.designs.length > 1) {
      const title = row(body, design.name, 0);
      body.rows[0].cells[0].style.fontWeight = 600;
      body.rows[0].cells[0].colSpan = 2;
    }
    cells.push(design.points.map((name) => {
      const cell = row(body, name, 1)[0], number = document.createElement("span"), spot = document.createElement("i");
      cell.append(number, spot);
      return { number, spot };
    }));
  }
  const colours = data.scale.colours.map((colour) => new THREE.Color(colour));
  function colourOf(distance) {
    const place = Math.min(1, Math.max(0, distance / data.scale.top)) * (colours.length - 1);
    const k = Math.min(colours.length - 2, Math.floor(place));
    return `#${colours[k].clone().lerp(colours[k + 1], place - k).getHexString()}`;
  }
  function showDistances(time) {
    data.designs.forEach((design, d) => {
      let k = 0;
      while (k < design.times.length - 2 && design.times[k + 1] < time) k++;
      const next = Math.min(k + 1, design.times.length - 1), span = design.times[next] - design.times[k];
      const share = span > 0 ? Math.min(1, Math.max(0, (time - design.times[k]) / span)) : 0;
      cells[d].forEach(({ number, spot }, i) => {
        const value = design.distances[k][i] + share * (design.distances[next][i] - design.distances[k][i]);
        number.textContent = `${value.toFixed(1)} mm`;
        spot.style.background = colourOf(value);
      });
    });
  }

  // Where each joint is, and how fast it moves.
  const places = data.designs.map((design) => {
    const body = byId("joints").createTBody();
    if (data.designs.length > 1) row(body, design.name, 0);
    return design.sliding.map((_, i) => row(body, `J${i + 1}`, 2));
  });
  function showJoints(time) {
    data.designs.forEach((design, d) => {
      let k = 0;
      while (k < design.times.length - 2 && design.times[k + 1] <= time) k++;
      const next = Math.min(k + 1, design.times.length - 1), span = design.times[next] - design.times[k];
      const share = span > 0 ? Math.min(1, Math.max(0, (time - design.times[k]) / span)) : 0;
      design.sliding.forEach((slides, i) => {
        const from = design.joints[k][i], change = design.joints[next][i] - from, unit = slides ? "mm" : "°";
        places[d][i][0].textContent = `${(from + share * change).toFixed(1)} ${unit}`;
        places[d][i][1].textContent = `${(span > 0 && time < design.times[next] ? change / span : 0).toFixed(0)} ${unit}/s`;
      });
    });
  }

  // Play, pause, slider: MeshCat's own animation, moved from here.
  slider.max = data.duration;
  function go(time) {
    animator.seek(Math.min(data.duration, Math.max(0, time)));
    animator.display_progress(Math.min(data.duration, Math.max(0, time)));
  }
  function toggle() {
    if (animator.playing) animator.pause();
    else animator.play();
  }
  button.addEventListener("click", toggle);
  slider.addEventListener("input", () => go(Number(slider.value)));
  byId("speed").addEventListener("change", (event) => { animator.mixer.timeScale = Number(event.target.value); });
  byId("controls").addEventListener("submit", (event) => event.preventDefault());
  document.addEventListener("keydown", (event) => {
    if (event.key !== " " || event.target.closest("button, select, summary")) return;
    event.preventDefault();
    toggle();
  });
  function follow() {
    const wanted = /(?:^|[#&])t=([0-9.]+)/.exec(location.hash);
    animator.play();
    if (wanted === null) return;
    animator.pause();
    go(Number(wanted[1]));
  }
  window.addEventListener("hashchange", follow);
  follow();

  let shown = null;
  function refresh() {
    requestAnimationFrame(refresh);
    moveTexts();
    button.textContent = animator.playing ? "Pause" : "Play";
    if (animator.time === shown) return;
    shown = animator.time;
    slider.value = shown;
    clock.textContent = `${shown.toFixed(2)} / ${data.duration.toFixed(2)} s`;
    showDistances(shown);
    showJoints(shown);
  }
  refresh();
  window.preview = { viewer, go };
})();
