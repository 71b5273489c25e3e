#!/usr/bin/env python3
"""Are our fibers at least as fast as the `hair` BSDF of Mitsuba 3, on the same core, in one run?

    cargo build --release -p cuticle-bench --bin fiber_bulk
    python3 lab/bench/peers/hair_bsdf.py --date 2026-12-31

Installs Mitsuba into a scratch virtual environment, checks that both sides compute the same numbers at the same
points, measures ours and theirs in turn, and writes `lab/bench/results/DATE-hair-bsdf.md`. Everything is pinned to
one core. Needs the package index (once, with --folder) and nothing beyond Python's standard library.

Mitsuba's scalar variant can be called from Python one point at a time only, and a call costs more than a diffuse
BSDF. So it is measured in two ways, and its vectorised variant in a third:

- compiled: inside its own `direct` integrator, whose inner loop is compiled. A plane whose vertex normals make it
  look like a ball to an orthographic camera gives every pixel another direction and offset; a constant sky makes the
  directions of the light uniform. The same scene with a `diffuse` BSDF is subtracted, so that what remains is `hair`
  less the few nanoseconds of `diffuse`: a lower bound of what `hair` costs.
- called: a loop in Python over the same points as ours, less the same loop over the `null` BSDF, which goes through
  the same binding and returns the same types.
- wavefront: `llvm_ad_rgb` on one thread, many points per call: SIMD code. Time of the kernels alone, without tracing.
"""

import argparse
import gc
import json
import math
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

MITSUBA = "3.9.1"
POINTS = 4096
HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]

# --- The peer, one repetition, inside the virtual environment


def in_peer_frame(point):
    """Both directions of a point in Mitsuba's frame: tangent +y, normal +z, the offset being the sine of the azimuth
    of the known direction from z to x."""
    (ku, kv, kw), (su, sv, sw), h = point["known"], point["light"], point["h"]
    across = math.hypot(kv, kw)
    near, far = h, math.sqrt(max(0.0, 1.0 - h * h))
    # The light's part in the normal plane, along that of the known direction and a quarter turn on.
    along, turned = (sv * kv + sw * kw) / across, (sw * kv - sv * kw) / across
    wi = [near * across, ku, far * across]
    wo = [near * along + far * turned, su, far * along - near * turned]
    return wi, wo


def hair(setup):
    """Mitsuba's description of the same fiber."""
    return {
        "type": "hair",
        "longitudinal_roughness": setup["beta_m"],
        "azimuthal_roughness": setup["beta_n"],
        "scale_tilt": setup["alpha_deg"],
        "int_ior": setup["eta"],
        "ext_ior": 1.0,
        "sigma_a": {"type": "rgb", "value": setup["sigma_a"]},
    }


def ball_on_a_plane(path, cells=96):
    """Writes a square mesh whose frames turn the direction (0, 0, 1) into every direction of a hemisphere, uniform in
    the projection along it: `wi = (x, y, sqrt(1 - x² - y²))` with `(x, y)` uniform in the disk. Between vertices the
    frames are interpolated, which keeps a little off the rim: with 96 cells the mean albedo is 0.7 % too high."""
    vertices = []
    for j in range(cells + 1):
        for i in range(cells + 1):
            a, b = 2.0 * i / cells - 1.0, 2.0 * j / cells - 1.0
            # From square to disk without changing ratios of areas, and away from the rim.
            if abs(a) > abs(b):
                r, phi = a, math.pi / 4.0 * b / a
            else:
                r, phi = b, math.pi / 2.0 - (math.pi / 4.0 * a / b if b else 0.0)
            x, y = 0.999 * r * math.cos(phi), 0.999 * r * math.sin(phi)
            z = math.sqrt(1.0 - x * x - y * y)
            # The frame's s axis is the mesh's u axis made orthogonal to the normal: solved for s.z = x, t.z = y.
            q = math.hypot(x, z)
            vertices.append((a, b, 0.0, -x / q, -z * y / q, z, i / cells, j / cells))
    faces = []
    for j in range(cells):
        for i in range(cells):
            k = j * (cells + 1) + i
            faces += [(k, k + 1, k + cells + 2), (k, k + cells + 2, k + cells + 1)]
    header = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz", "u", "v")]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    body = [" ".join(f"{c:.9g}" for c in vertex) for vertex in vertices]
    body += [f"3 {a} {b} {c}" for a, b, c in faces]
    path.write_text("\n".join(header + body) + "\n")


def luminance(rgb):
    return 0.212671 * rgb[0] + 0.715160 * rgb[1] + 0.072169 * rgb[2]


def measure_compiled(mi, setup, folder, seed):
    """Nanoseconds of value with density and of a sample, for `hair` and `diffuse`, and the mean luminance that the
    pixels get from `hair`."""
    side, shots = 64, 64
    mesh = folder / "ball_on_a_plane.ply"
    ball_on_a_plane(mesh)

    def scene(bsdf):
        return mi.load_dict({
            "type": "scene",
            "mesh": {"type": "ply", "filename": str(mesh), "bsdf": bsdf},
            "sky": {"type": "constant"},
            "camera": {
                "type": "orthographic",
                "to_world": mi.ScalarTransform4f().look_at([0, 0, 2], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": side, "height": side, "rfilter": {"type": "box"}},
                "sampler": {"type": "independent", "sample_count": 1},
            },
        })

    scenes = {"hair": scene(hair(setup)), "diffuse": scene({"type": "diffuse"})}
    for a, b in [(0.0, 0.5), (0.5, 0.25), (-0.25, -0.75)]:
        wi = scenes["hair"].ray_intersect(mi.Ray3f([a, b, 2.0], [0.0, 0.0, -1.0])).wi
        # The map from square to disk keeps squares around the centre as circles.
        assert abs(math.hypot(wi[0], wi[1]) - 0.999 * max(abs(a), abs(b))) < 0.02, f"the ball is bent at {a}, {b}: {wi}"
    kinds = {"eval_pdf": (shots, 0), "sample": (0, shots)}
    out = {}
    for kind, (emitter, bsdf) in kinds.items():
        integrator = mi.load_dict(
            {"type": "direct", "emitter_samples": emitter, "bsdf_samples": bsdf, "hide_emitters": True})
        for name, world in scenes.items():
            integrator.render(world, seed=2 * seed, spp=1)
            start = time.perf_counter()
            image = integrator.render(world, seed=2 * seed + 1, spp=1)
            out[f"compiled_{kind}_{name}"] = (time.perf_counter() - start) * 1e9 / (side * side * shots)
            if name == "hair":
                pixels = list(image.array)
                mean = [sum(pixels[c::3]) / (side * side) for c in range(3)]
                out[f"check_{kind}"] = luminance(mean)
    return out


def measure_called(mi, setup):
    """Nanoseconds per call from Python, for `hair` and `null`, and the values at the points."""
    context = mi.BSDFContext()
    interactions, lights, numbers = [], [], []
    for point in setup["points"]:
        wi, wo = in_peer_frame(point)
        interaction = mi.SurfaceInteraction3f()
        interaction.wi = wi
        interactions.append(interaction)
        lights.append(mi.Vector3f(wo))
        u = point["numbers"]
        numbers.append((u[0], mi.Point2f(u[1], u[2])))
    bsdfs = {"hair": mi.load_dict(hair(setup)), "null": mi.load_dict({"type": "null"})}

    def evaluate(call):
        for interaction, light in zip(interactions, lights):
            call(context, interaction, light)

    def sample(call):
        for interaction, (first, rest) in zip(interactions, numbers):
            call(context, interaction, first, rest)

    out = {}
    gc.disable()
    for kind in ("eval", "pdf", "eval_pdf", "sample"):
        run = sample if kind == "sample" else evaluate
        for name, bsdf in bsdfs.items():
            call = getattr(bsdf, kind)
            run(call)
            start = time.perf_counter()
            for _ in range(4):
                run(call)
            out[f"called_{kind}_{name}"] = (time.perf_counter() - start) * 1e9 / (4 * len(lights))
    gc.enable()
    values = [bsdfs["hair"].eval_pdf(context, i, w) for i, w in zip(interactions, lights)]
    weights = [bsdfs["hair"].sample(context, i, a, b)[1] for i, (a, b) in zip(interactions, numbers)]
    out["values"] = [[[fcos[0], fcos[1], fcos[2]], pdf] for fcos, pdf in values]
    out["weight"] = statistics.fmean(luminance(weight) for weight in weights)
    return out


def measure_wavefront(mi, dr, setup):
    """Nanoseconds per point in the compiled kernels of the vectorised variant, on one thread."""
    dr.set_thread_count(1)
    size = 1 << 18
    index = dr.arange(mi.UInt32, size) % len(setup["points"])

    def vector(rows):
        table = [mi.Float([row[c] for row in rows]) for c in range(3)]
        return mi.Vector3f(*[dr.gather(mi.Float, column, index) for column in table])

    pairs = [in_peer_frame(point) for point in setup["points"]]
    wi, wo = vector([wi for wi, _ in pairs]), vector([wo for _, wo in pairs])
    u = vector([point["numbers"] for point in setup["points"]])
    dr.eval(wi, wo, u)
    interaction = dr.zeros(mi.SurfaceInteraction3f, size)
    interaction.wi = wi
    context, bsdf = mi.BSDFContext(), mi.load_dict(hair(setup))

    def sample():
        drawn, weight = bsdf.sample(context, interaction, u.x, mi.Point2f(u.y, u.z))
        dr.eval(drawn.wo, drawn.pdf, weight)

    calls = {
        "eval": lambda: dr.eval(bsdf.eval(context, interaction, wo)),
        "pdf": lambda: dr.eval(bsdf.pdf(context, interaction, wo)),
        "eval_pdf": lambda: dr.eval(bsdf.eval_pdf(context, interaction, wo)),
        "sample": sample,
    }
    out = {}
    for kind, call in calls.items():
        # The first call compiles.
        call()
        dr.sync_thread()
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            call()
            dr.sync_thread()
            kernels = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]
        assert kernels, f"nothing ran for {kind}"
        out[f"wavefront_{kind}"] = sum(k["execution_time"] for k in kernels) * 1e6 / size
    out["llvm"] = ".".join(str(number) for number in dr.detail.llvm_version())
    return out


def work(kind, points, folder, seed):
    """One repetition of the peer; prints JSON."""
    import drjit as dr
    import mitsuba as mi

    assert mi.__version__ == MITSUBA, f"this is Mitsuba {mi.__version__}, not {MITSUBA}"
    setup = json.loads(Path(points).read_text())
    if kind == "scalar":
        mi.set_variant("scalar_rgb")
        # Parsing text is slow, it warns; it is not timed.
        mi.set_log_level(mi.LogLevel.Error)
        dr.set_thread_count(1)
        out = measure_compiled(mi, setup, Path(folder), seed) | measure_called(mi, setup)
    else:
        mi.set_variant("llvm_ad_rgb")
        out = measure_wavefront(mi, dr, setup)
    print(json.dumps(out))


# --- The comparison, outside


def fail(message):
    sys.exit(f"error: {message}")


def run(command, **more):
    return subprocess.run([str(part) for part in command], capture_output=True, text=True, **more)


def last_line(text):
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else "(it said nothing)"


def install(folder):
    """A Python with the right Mitsuba in `folder`."""
    environment = folder / "venv"
    python = environment / "bin" / "python"
    probe = [python, "-c", "import mitsuba; print(mitsuba.__version__)"]
    if python.exists():
        found = run(probe)
        if found.returncode == 0 and found.stdout.strip() == MITSUBA:
            return python
    made = run([sys.executable, "-m", "venv", environment])
    if made.returncode != 0:
        fail(f"cannot make a virtual environment: {last_line(made.stdout + made.stderr)}")
    pip = [python, "-m", "pip", "install", "--disable-pip-version-check", "--retries", "1", "--timeout", "20"]
    got = run([*pip, f"mitsuba=={MITSUBA}"])
    if got.returncode != 0:
        fail(
            f"cannot install mitsuba=={MITSUBA} with pip: {last_line(got.stderr)}\n"
            "Without the package index give --folder DIR, where DIR/venv is a virtual environment that has it.")
    found = run(probe)
    if found.returncode != 0 or found.stdout.strip() != MITSUBA:
        fail(f"mitsuba is installed but does not start: {last_line(found.stderr)}")
    return python


def llvm_libraries(wanted):
    """Where an LLVM may be: the one asked for, or what Dr.Jit finds itself, then the Rust compiler's."""
    if wanted:
        return [wanted]
    found = [None]
    try:
        rust = run(["rustc", "--print", "sysroot"])
    except OSError:
        return found
    if rust.returncode == 0:
        found += sorted(str(path) for path in Path(rust.stdout.strip(), "lib").glob("libLLVM*"))
    return found


def peer(python, kind, points, folder, seed, llvm=None):
    """One repetition of the peer; `None` and the reason when it cannot run."""
    # Dr.Jit keeps its compiled kernels in the home folder; they belong to the scratch folder.
    env = os.environ | {"HOME": str(folder)} | ({"DRJIT_LIBLLVM_PATH": llvm} if llvm else {})
    done = run([python, Path(__file__).resolve(), "--worker", kind, points, folder, seed], env=env)
    if done.returncode == 0:
        return json.loads(done.stdout.splitlines()[-1]), None
    complaint = [line for line in done.stderr.splitlines() if "error" in line.lower()]
    return None, complaint[0].strip() if complaint else last_line(done.stderr)


def ours(binary, *arguments):
    done = run([binary, *arguments])
    if done.returncode != 0:
        fail(f"{binary} {' '.join(map(str, arguments))}: {last_line(done.stderr)}")
    return json.loads(done.stdout)


def check_agreement(setup, theirs):
    """Both sides must compute the same function; returns a sentence that says how nearly."""
    worst_value = worst_pdf = 0.0
    compared = 0
    for point, (fcos, pdf) in zip(setup["points"], theirs["values"], strict=True):
        largest = max(point["fcos"])
        if largest > 1e-4:
            worst_value = max(worst_value, max(abs(a - b) for a, b in zip(fcos, point["fcos"])) / largest)
            worst_pdf = max(worst_pdf, abs(pdf - point["pdf"]) / point["pdf"])
            compared += 1
    # 0.55 % is the known difference: Mitsuba's logarithm of I0 has half of the first correction.
    if worst_value > 7e-3 or worst_pdf > 7e-3 or compared < len(setup["points"]) // 2:
        fail(f"not the same function: values differ by up to {worst_value:.2%}, densities by {worst_pdf:.2%} "
             f"({compared} points compared)")
    mean = statistics.fmean(luminance(point["weight"]) for point in setup["points"])
    for what, value in [
        ("samples", theirs["weight"]),
        ("pixels by light samples", theirs["check_eval_pdf"]),
        ("pixels by BSDF samples", theirs["check_sample"]),
    ]:
        # Standard error 0.5 % for 4096 points a side, and the ball's 0.7 %; all numbers are seeded.
        if abs(value / mean - 1.0) > 0.03:
            fail(f"not the same fiber: mean luminance {mean:.4f} here, {value:.4f} there in {what}")
    return (
        f"at {compared} points whose value is above 1e-4, values differ by at most {worst_value:.2%} of their largest "
        f"channel and densities by {worst_pdf:.2%}; mean luminance of a sample's weight {mean:.4f} here, "
        f"{theirs['weight']:.4f} there, {theirs['check_eval_pdf']:.4f} and {theirs['check_sample']:.4f} in the "
        "compiled loop")


def machine():
    text = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else ""
    fields = dict(line.split(":", 1) for line in text.splitlines() if ":" in line)
    fields = {key.strip(): value.strip() for key, value in fields.items()}
    flags = fields.get("flags", "").split()
    simd = next((name for name in ("avx512f", "avx2", "sse4_2") if name in flags), "no SIMD known")
    family = f"family {fields.get('cpu family', '?')}, model {fields.get('model', '?')}"
    return f"{fields.get('model name', platform.machine())} ({family}, {simd}), {os.cpu_count()} cores"


def compare(options):
    binary = Path(options.ours)
    if not binary.exists():
        fail(f"{binary} is missing; cargo build --release -p cuticle-bench --bin fiber_bulk")
    try:
        time.strptime(options.date, "%Y-%m-%d")
    except ValueError:
        fail(f"--date is YYYY-MM-DD, not {options.date!r}")
    if hasattr(os, "sched_setaffinity"):
        core = max(os.sched_getaffinity(0)) if options.core is None else options.core
        try:
            os.sched_setaffinity(0, {core})
        except OSError as error:
            fail(f"cannot use core {core}: {error}")
    else:
        fail("this needs Linux: both sides must be pinned to one core")

    with tempfile.TemporaryDirectory(prefix="hair_bsdf_") as scratch:
        folder = Path(options.folder or scratch).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        python = install(folder)
        setup = ours(binary, "points", POINTS)
        points = folder / "points.json"
        points.write_text(json.dumps(setup))

        first, why = peer(python, "scalar", points, folder, 0)
        if first is None:
            fail(f"Mitsuba does not run: {why}")
        agreement = check_agreement(setup, first)
        llvm = None
        refusals = []
        for library in llvm_libraries(options.llvm):
            vector, why = peer(python, "wavefront", points, folder, 0, library)
            if vector is not None:
                llvm = (library, vector["llvm"])
                break
            refusals.append(why)

        before = os.getloadavg()[0]
        rounds = []
        for seed in range(1, options.repetitions + 1):
            numbers = {
                f"{model}.{what}": ns
                for model, row in ours(binary, "time", POINTS, options.millis).items()
                for what, ns in row.items()
            }
            kinds = [("scalar", None)] + ([("wavefront", llvm[0])] if llvm else [])
            for kind, library in kinds:
                theirs, why = peer(python, kind, points, folder, seed, library)
                if theirs is None:
                    fail(f"Mitsuba stopped running in repetition {seed}: {why}")
                wanted = ("compiled_", "called_", "wavefront_")
                numbers |= {f"mitsuba.{key}": ns for key, ns in theirs.items() if key.startswith(wanted)}
            for kind in ("eval_pdf", "sample"):
                key = f"mitsuba.compiled_{kind}"
                numbers[key] = numbers[f"{key}_hair"] - numbers[f"{key}_diffuse"]
            for kind in ("eval", "pdf", "eval_pdf", "sample"):
                key = f"mitsuba.called_{kind}"
                numbers[key] = numbers[f"{key}_hair"] - numbers[f"{key}_null"]
            rounds.append(numbers)
            print(f"repetition {seed} of {options.repetitions}", file=sys.stderr)
        after = os.getloadavg()[0]
    return {
        "date": options.date,
        "core": core,
        "agreement": agreement,
        "llvm": llvm and llvm[1],
        "refusals": refusals,
        "load": (before, after),
        "rounds": rounds,
        "millis": options.millis,
        "setup": setup,
    }


def least(rounds, key):
    """The shortest time; of a difference, the difference of the shortest, since the shortest difference would be
    the one whose subtrahend was disturbed."""
    for part, other in (("compiled_", "diffuse"), ("called_", "null")):
        name = key.removeprefix("mitsuba.")
        if name.startswith(part) and not name.endswith(("_hair", f"_{other}")):
            return least(rounds, f"{key}_hair") - least(rounds, f"{key}_{other}")
    return min(numbers[key] for numbers in rounds)


def page(found):
    """The result as Markdown."""
    rounds = found["rounds"]

    def middle(key):
        return statistics.median(numbers[key] for numbers in rounds)

    def cell(key):
        return f"{middle(key):.0f} ({least(rounds, key):.0f})"

    def ratio(theirs, mine):
        return f"{middle(theirs) / middle(mine):.2f} ({least(rounds, theirs) / least(rounds, mine):.2f})"

    setup = found["setup"]
    models = [("Chiang", "chiang"), ("d'Eon, near field", "deon_near"), ("d'Eon, far field", "deon_far")]
    fiber = (f"roughness {setup['beta_m']:.3g} and {setup['beta_n']:.3g}, tilt {setup['alpha_deg']:.3g} degrees, index "
             f"{setup['eta']:.3g}, absorption {', '.join(f'{x:.4g}' for x in setup['sigma_a'])}")
    lines = [
        f"# {found['date']}: our fibers and Mitsuba's `hair`",
        "",
        f"    python3 lab/bench/peers/hair_bsdf.py --date {found['date']} --repetitions {len(rounds)}",
        "",
        f"Machine: {machine()}; everything pinned to core {found['core']}, one thread, single precision. Load average "
        f"{found['load'][0]:.2f} before, {found['load'][1]:.2f} after. Mitsuba {MITSUBA} from its wheel; ours built "
        "with the release profile of the workspace.",
        "",
        f"Both evaluate the model of Chiang et al. with {fiber}; d'Eon's has the same widths of R. {len(rounds)} "
        f"repetitions of ours, then theirs; {POINTS} points with uniform offsets and light from everywhere "
        f"({found['millis']} ms for each of our figures). Nanoseconds per call: median (shortest) of the repetitions.",
        "",
        f"They compute the same: {found['agreement']}.",
        "",
        "## From nothing but two directions",
        "",
        "What Mitsuba does at every call: no set-up is kept between calls, directions are vectors. Ours includes "
        "turning vectors into angles and `prepare`. *Compiled* is the loop of Mitsuba's `direct` integrator, `hair` "
        "less `diffuse`: a lower bound. *Called* is a Python loop less the same loop over `null`. Ratios above 1 mean "
        "that ours is faster. Mitsuba has no far field, which is an integral over the offsets: the ratio tells what "
        "that costs.",
        "",
        "| | value and density | sample with weight and density |",
        "|---|---|---|",
    ]
    scalar = [("Mitsuba scalar_rgb, compiled", "compiled"), ("Mitsuba scalar_rgb, called", "called")]
    for title, way in scalar:
        lines.append(f"| {title} | {cell(f'mitsuba.{way}_eval_pdf')} | {cell(f'mitsuba.{way}_sample')} |")
    for title, model in models:
        lines.append(f"| {title} | {cell(f'{model}.vectors_eval_pdf')} | {cell(f'{model}.vectors_sample')} |")
    for title, model in models:
        for name, way in scalar:
            cells = [ratio(f"mitsuba.{way}_{kind}", f"{model}.vectors_{kind}") for kind in ("eval_pdf", "sample")]
            lines.append(f"| ratio, {name.removeprefix('Mitsuba scalar_rgb, ')} / {title} | {' | '.join(cells)} |")
    lines += [
        "",
        "## Value alone, density alone",
        "",
        f"Mitsuba scalar_rgb, called: value {cell('mitsuba.called_eval')}, density {cell('mitsuba.called_pdf')}, both "
        f"{cell('mitsuba.called_eval_pdf')}. With the cost of the call left in: {cell('mitsuba.called_eval_hair')}, "
        f"{cell('mitsuba.called_pdf_hair')}, {cell('mitsuba.called_eval_pdf_hair')}; a sample "
        f"{cell('mitsuba.called_sample_hair')}.",
        "",
        "## With the set-up kept",
        "",
        "A renderer prepares a point once and asks it about many directions. Mitsuba cannot; the ratio is its compiled "
        "figure over ours. Directions are given as angles.",
        "",
        "| | prepare | value and density | sample | prepare + value and density | prepare + sample | ratio of values "
        "| ratio of samples |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for title, model in models:
        keys = ("prepare", "eval_pdf", "sample", "prepare_eval_pdf", "prepare_sample")
        cells = [cell(f"{model}.{key}") for key in keys]
        cells += [ratio(f"mitsuba.compiled_{kind}", f"{model}.{kind}") for kind in ("eval_pdf", "sample")]
        lines.append(f"| {title} | {' | '.join(cells)} |")
    lines += ["", "## Mitsuba's vectorised variant", ""]
    if found["llvm"]:
        keys = [f"mitsuba.wavefront_{kind}" for kind in ("eval", "pdf", "eval_pdf", "sample")]
        lines += [
            f"llvm_ad_rgb, one thread, {1 << 18} points per call, LLVM {found['llvm']}: time of its kernels alone, "
            "SIMD across points. Another kind of work than one path at a time, which is what both scalar rows and ours "
            "are; it stands here to be known. Ratios are to ours from two directions.",
            "",
            "| | value | density | both | sample |",
            "|---|---|---|---|---|",
            f"| llvm_ad_rgb | {' | '.join(cell(key) for key in keys)} |",
        ]
        for title, model in models:
            cells = [ratio(f"mitsuba.wavefront_{kind}", f"{model}.vectors_{kind}") for kind in ("eval_pdf", "sample")]
            lines.append(f"| ratio / {title} | | | {' | '.join(cells)} |")
    else:
        reasons = "; ".join(dict.fromkeys(str(why) for why in found["refusals"]))
        lines.append(f"Not measured: llvm_ad_rgb does not run here ({reasons}).")
    lines += ["", "## Verdict", ""]
    for title, model in models:
        worst = min(
            min(middle(f"mitsuba.{way}_{kind}"), least(rounds, f"mitsuba.{way}_{kind}"))
            / max(middle(f"{model}.vectors_{kind}"), least(rounds, f"{model}.vectors_{kind}"))
            for way in ("compiled", "called") for kind in ("eval_pdf", "sample"))
        verdict = "at least as fast as Mitsuba's `hair`, scalar_rgb" if worst >= 1.0 else "slower than Mitsuba's `hair`"
        lines.append(f"- {title}: {verdict}; the worst of all ratios, shortest of theirs over median of ours, is "
                     f"{worst:.2f}.")
    for what, key, aim in [
        ("Chiang, value and density", "chiang.eval_pdf", 100.0),
        ("Chiang, sample", "chiang.sample", 150.0),
        ("d'Eon far field, value and density", "deon_far.eval_pdf", 1000.0),
    ]:
        verdict = "met" if middle(key) < aim else "missed"
        lines.append(f"- aim for {what}, set-up kept, below {aim:.0f} ns: {middle(key):.0f} ns, {verdict}.")
    lines += ["", "## Raw", "", "Nanoseconds per call, repetition by repetition.", ""]
    lines += ["| | " + " | ".join(str(i + 1) for i in range(len(rounds))) + " |", "|---|" + "---|" * len(rounds)]
    for key in sorted(rounds[0]):
        lines.append(f"| `{key}` | " + " | ".join(f"{numbers[key]:.1f}" for numbers in rounds) + " |")
    return "\n".join(lines) + "\n"


def main():
    if sys.argv[1:2] == ["--worker"]:
        kind, points, folder, seed = sys.argv[2:6]
        work(kind, points, folder, int(seed))
        return
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--date", required=True, help="date of the result, YYYY-MM-DD")
    parser.add_argument("--ours", default=ROOT / "target/release/fiber_bulk", help="our binary")
    parser.add_argument("--folder", help="keep the virtual environment here (default: a temporary folder)")
    parser.add_argument("--repetitions", type=int, default=11, help="how often each side is measured")
    parser.add_argument("--millis", type=int, default=40, help="milliseconds for each of our figures")
    parser.add_argument("--core", type=int, help="the core to use (default: the last)")
    parser.add_argument("--llvm", help="an LLVM library of version 15 or newer, for llvm_ad_rgb")
    parser.add_argument("--out", default=HERE.parent / "results", help="folder of the result")
    options = parser.parse_args()
    if options.repetitions < 1 or options.millis < 1:
        fail("--repetitions and --millis are at least 1")
    result = Path(options.out) / f"{options.date}-hair-bsdf.md"
    text = page(compare(options))
    result.parent.mkdir(parents=True, exist_ok=True)
    result.write_text(text)
    print(result)


if __name__ == "__main__":
    main()
