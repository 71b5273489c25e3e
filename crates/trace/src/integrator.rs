//! One sample: a path from the camera.

use accel::{Hit, Ray, StrandHit, TriangleHit};
use fiber::{Dir, FiberSetup, GroomFiber, Lobes, Model, Scatter};
use film::Sample;
use math::{Frame, Rgb, Vec3, hash, warp};
use scene::{Heuristic, Integrator, StrandPoint};

use crate::Tracer;
use crate::sampler::Sampler;

/// Random stream of the direction of the longer diameter of strands that are not round.
const MAJOR_AXIS: u32 = 0x6d61_6a6f;

/// Where the path scattered last, as far as multiple importance sampling needs it.
struct Last {
    position: Vec3,
    /// Density of the ray; `None`: ask the fiber.
    pdf: Option<f32>,
    fiber: Option<(FiberSetup, Dir)>,
}

impl Last {
    fn pdf(&self) -> f32 {
        match (self.pdf, &self.fiber) {
            (Some(pdf), _) => pdf,
            (None, Some((setup, dir))) => setup.pdf(*dir),
            (None, None) => 0.0,
        }
    }
}

/// What a vertex multiplies light by, per lobe; the fifth is what is no lobe of a fiber.
#[derive(Clone, Copy)]
struct Split {
    lobes: Lobes,
    other: Rgb,
}

impl Split {
    fn fiber(lobes: Lobes) -> Self {
        Self { lobes, other: Rgb::black() }
    }

    fn surface(other: Rgb) -> Self {
        Self { lobes: Lobes::zero(), other }
    }

    fn sum(&self) -> Rgb {
        self.lobes.sum() + self.other
    }
}

/// The path's result while it grows.
struct Tally {
    out: Sample,
    clamp: Option<f32>,
}

impl Tally {
    /// Light that the camera sees with no scattering between.
    fn emitted(&mut self, light: Rgb) {
        self.out.beauty += light;
        self.out.direct += light;
    }

    /// Light that came after `events` scattering events; `split` belongs to the first, `rest` to what lies
    /// behind it.
    fn scattered(&mut self, split: &Split, rest: Rgb, events: u32) {
        let mut rest = rest;
        if let (Some(most), true) = (self.clamp, events > 1) {
            let size = (split.sum() * rest).max_channel();
            if size > most {
                rest *= most / size;
            }
        }
        for (lobe, share) in self.out.lobes.iter_mut().zip(split.lobes.0) {
            *lobe += share * rest;
        }
        let light = split.sum() * rest;
        self.out.beauty += light;
        if events > 1 {
            self.out.indirect += light;
        } else {
            self.out.direct += light;
        }
    }
}

/// A vertex that can scatter.
#[expect(clippy::large_enum_variant, reason = "one at a time, on the stack; boxing would allocate per vertex")]
enum Vertex<'a> {
    Fiber { hit: &'a StrandHit, frame: Frame, setup: FiberSetup },
    Surface { hit: &'a TriangleHit, geometric: Vec3, shading: Vec3, albedo: Rgb },
}

impl Vertex<'_> {
    /// Value (with the cosine) and density towards `dir`.
    fn eval_pdf(&self, dir: Vec3) -> (Split, f32) {
        match self {
            Self::Fiber { frame, setup, .. } => {
                let (fcos, pdf) = setup.eval_pdf(local(frame, dir));
                (Split::fiber(fcos), pdf)
            }
            Self::Surface { geometric, shading, albedo, .. } => {
                let cos = dir.dot(*shading);
                if cos <= 0.0 || dir.dot(*geometric) <= 0.0 {
                    return (Split::surface(Rgb::black()), 0.0);
                }
                let pdf = cos * std::f32::consts::FRAC_1_PI;
                (Split::surface(*albedo * pdf), pdf)
            }
        }
    }

    /// Value alone.
    fn eval(&self, dir: Vec3) -> Split {
        match self {
            Self::Fiber { frame, setup, .. } => Split::fiber(setup.eval(local(frame, dir))),
            Self::Surface { .. } => self.eval_pdf(dir).0,
        }
    }

    fn ray(&self, dir: Vec3) -> Ray {
        match self {
            Self::Fiber { hit, .. } => Ray { leaving: Some(hit.leave(dir)), ..Ray::new(hit.position, dir) },
            Self::Surface { hit, .. } => Ray::new(hit.leave(dir), dir),
        }
    }

    fn position(&self) -> Vec3 {
        match self {
            Self::Fiber { hit, .. } => hit.position,
            Self::Surface { hit, .. } => hit.position,
        }
    }
}

fn local(frame: &Frame, dir: Vec3) -> Dir {
    Dir::from_local(frame.to_local(dir).to_array())
}

/// The frame around unit `u` whose second axis lies towards `axis`, as far as it can.
fn across(u: Vec3, axis: Vec3) -> Frame {
    match (axis - u * u.dot(axis)).try_normalize() {
        Some(v) => Frame { u, v, w: u.cross(v) },
        None => Frame::around(u),
    }
}

fn weight(heuristic: Heuristic, own: f32, other: f32) -> f32 {
    match heuristic {
        Heuristic::Balance => own / (own + other),
        Heuristic::Power => {
            // By the ratio, so that squares cannot overflow.
            let r = other / own;
            1.0 / (1.0 + r * r)
        }
    }
}

impl Tracer {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.accel.closest(ray)
    }

    /// The first thing the camera sees: meshes that are hidden from it are stepped over.
    fn closest_visible(&self, ray: &Ray) -> Option<Hit> {
        let mut ray = *ray;
        // More layers of hidden meshes than this do not occur in earnest.
        for _ in 0..64 {
            let hit = self.closest(&ray)?;
            match hit {
                Hit::Triangle(t) if !self.scene.meshes[t.set as usize].visible => {
                    // Hits at exactly this distance do not count again.
                    ray.t_min = t.t;
                }
                _ => return Some(hit),
            }
        }
        None
    }

    /// What lies where a ray along `dir` ended; `first` says that the ray came from the camera.
    fn vertex<'a>(&self, hit: &'a Hit, dir: Vec3, first: bool) -> Vertex<'a> {
        match hit {
            Hit::Strand(hit) => {
                let groom = &self.scene.grooms[hit.set as usize];
                let look = &self.scene.looks[groom.look];
                let varying;
                let model = match look.for_groom() {
                    Some(model) => model,
                    None => {
                        varying = GroomFiber::Other(look.fiber(&StrandPoint {
                            strand: hit.strand - self.accel.first_strand(hit.set),
                            u: hit.u,
                            point_index: hit.point as usize,
                            frac: hit.fraction,
                            attributes: &groom.groom.attributes,
                            seed: groom.seed,
                        }));
                        &varying
                    }
                };
                let frame = if model.is_round() {
                    Frame::around(hit.tangent)
                } else {
                    // The longer diameter keeps its direction along a strand, and is another on every strand.
                    let axis = hash::mix2(groom.seed, MAJOR_AXIS);
                    let turn = [hash::unit(hit.strand, axis), hash::unit(hit.strand, axis ^ 1)];
                    across(hit.tangent, warp::uniform_sphere(turn))
                };
                let mut at = fiber::Hit::new(local(&frame, -dir), hit.h);
                // Only the camera has pixels; behind it the near field is right, and the cheaper one.
                if first {
                    at = at.with_width(self.camera.width_px(hit.position, 2.0 * hit.radius));
                }
                let setup = model.prepare(&at);
                Vertex::Fiber { hit, frame, setup }
            }
            Hit::Triangle(hit) => {
                let mesh = &self.scene.meshes[hit.set as usize];
                let geometric = if hit.normal.dot(dir) < 0.0 { hit.normal } else { -hit.normal };
                let shading = self.normals[hit.set as usize].as_ref().map_or(geometric, |normals| {
                    let [a, b, c] = mesh.mesh.triangles[hit.triangle as usize].map(|i| normals[i as usize]);
                    let [u, v] = hit.barycentric;
                    let n = (a * (1.0 - u - v) + b * u + c * v).normalize_or(geometric);
                    let n = if n.dot(geometric) < 0.0 { -n } else { n };
                    // A smooth normal that faces away from the viewer would lose the whole pixel.
                    if n.dot(dir) < 0.0 { n } else { geometric }
                });
                Vertex::Surface { hit, geometric, shading, albedo: mesh.albedo }
            }
        }
    }
}

/// What sample `index` of pixel `(x, y)` sees, and how many rays it took.
pub(crate) fn trace(tracer: &Tracer, x: u32, y: u32, index: u32) -> (Sample, u64) {
    let settings = &tracer.scene.render;
    let sampler = Sampler::new(x, y, index, settings.seed);
    let integrator = settings.integrator;
    let max_depth = if integrator == Integrator::Direct { 1 } else { settings.max_depth };
    let mut tally = Tally { out: Sample::default(), clamp: settings.clamp };
    let mut rays = 1_u64;

    let mut ray = tracer.camera.ray(x, y, sampler.pixel());
    let mut hit = tracer.closest_visible(&ray);
    // Weights of the first vertex, by lobe; throughput behind it.
    let mut split = Split::surface(Rgb::white());
    let mut beta = Rgb::white();
    let mut last: Option<Last> = None;

    let mut vertex_index = 0;
    loop {
        // Lights on the way, and those at infinity if nothing stopped the ray.
        let t_max = hit.map_or(f32::INFINITY, |hit| hit.t());
        tracer.lights.met(ray.origin, ray.dir, t_max, |met| match &last {
            None => {
                if met.visible {
                    tally.emitted(met.radiance);
                }
            }
            Some(last) => {
                let w = match integrator {
                    Integrator::BcsdfOnly => 1.0,
                    Integrator::LightOnly => 0.0,
                    Integrator::Path | Integrator::Direct => {
                        let light = tracer.lights.pdf(met.light, last.position, ray.dir);
                        if light > 0.0 { weight(settings.heuristic, last.pdf(), light) } else { 1.0 }
                    }
                };
                if w > 0.0 {
                    tally.scattered(&split, beta * met.radiance * w, vertex_index);
                }
            }
        });

        let Some(found) = hit else { break };
        if vertex_index == 0 {
            tally.out.alpha = 1.0;
            tally.out.depth = found.t();
            if let Hit::Strand(strand) = &found {
                tally.out.strand = strand.strand;
                tally.out.tangent = strand.tangent;
            }
        }
        if vertex_index >= max_depth {
            break;
        }
        let vertex = tracer.vertex(&found, ray.dir, vertex_index == 0);
        let events = vertex_index + 1;

        // Towards a light.
        if integrator != Integrator::BcsdfOnly {
            let u = sampler.light(vertex_index);
            if let Some(light) = tracer.lights.sample(vertex.position(), u[0], [u[1], u[2]]) {
                let (value, pdf) = if light.delta || integrator == Integrator::LightOnly {
                    (vertex.eval(light.dir), 0.0)
                } else {
                    vertex.eval_pdf(light.dir)
                };
                let w = if pdf > 0.0 { weight(settings.heuristic, light.pdf, pdf) } else { 1.0 };
                let arriving = light.radiance * (w / light.pdf);
                if !(value.sum() * arriving).is_black() {
                    let mut shadow = vertex.ray(light.dir);
                    // Lights are not in the way of rays, so the whole distance counts.
                    shadow.t_max = light.distance;
                    rays += 1;
                    if !tracer.accel.occluded(&shadow) {
                        if vertex_index == 0 {
                            tally.scattered(&value, arriving, events);
                        } else {
                            tally.scattered(&split, beta * value.sum() * arriving, events);
                        }
                    }
                }
            }
        }

        // Onwards.
        let u = sampler.direction(vertex_index);
        let rest = sampler.rest(vertex_index);
        let (dir, here, next) = match &vertex {
            Vertex::Fiber { hit, frame, setup } => {
                let Some(sample) = setup.sample([u[0], u[1], u[2], u[3], rest[0]]) else { break };
                let dir = frame.to_world(Vec3::from_array(sample.dir.to_local())).normalize();
                let next = Last {
                    position: hit.position,
                    pdf: sample.pdf,
                    fiber: sample.pdf.is_none().then_some((*setup, sample.dir)),
                };
                (dir, Split::fiber(sample.weight), next)
            }
            Vertex::Surface { hit, geometric, shading, albedo } => {
                let around = warp::cosine_hemisphere([u[0], u[1]]);
                let dir = Frame::around(*shading).to_world(around).normalize();
                if vertex_index == 0 {
                    tally.out.albedo = *albedo;
                }
                if dir.dot(*geometric) <= 0.0 {
                    break;
                }
                let pdf = around.x * std::f32::consts::FRAC_1_PI;
                (dir, Split::surface(*albedo), Last { position: hit.position, pdf: Some(pdf), fiber: None })
            }
        };
        if vertex_index == 0 {
            tally.out.albedo = here.sum();
            split = here;
        } else {
            beta *= here.sum();
        }

        let throughput = (split.sum() * beta).max_channel();
        if !(throughput > 0.0) {
            break;
        }
        if events >= settings.roulette_start {
            let survive = throughput.min(1.0);
            if rest[1] >= survive {
                break;
            }
            beta *= 1.0 / survive;
        }

        ray = vertex.ray(dir);
        rays += 1;
        hit = tracer.closest(&ray);
        last = Some(next);
        vertex_index += 1;
    }
    (tally.out, rays)
}
