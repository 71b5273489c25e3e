//! Intersection held against double-precision oracles that share no formula with it.

use accel::{Accel, Basis, Hit, Options, Ray, Shape, SimdLevel, StrandHit, Strands, Triangles};
use math::{DVec3, Vec3, hash, warp};

struct Rng(u32);

impl Rng {
    fn unit(&mut self) -> f32 {
        self.0 += 1;
        hash::unit(self.0, 0x5eed)
    }

    fn sphere(&mut self) -> Vec3 {
        warp::uniform_sphere([self.unit(), self.unit()])
    }
}

/// Strands with bends and taper in a ball of radius 1.
fn groom(strands: usize, points: usize, radius: f32, rng: &mut Rng) -> (Vec<Vec3>, Vec<f32>, Vec<u32>) {
    let (mut p, mut r, mut o) = (Vec::new(), Vec::new(), vec![0]);
    for _ in 0..strands {
        let mut at = rng.sphere() * rng.unit();
        let mut dir = rng.sphere();
        for i in 0..points {
            p.push(at);
            r.push(radius * (1.0 - 0.5 * i as f32 / points as f32));
            at += dir * 0.1;
            dir = (dir + rng.sphere() * 0.4).normalize();
        }
        o.push(p.len() as u32);
    }
    (p, r, o)
}

fn rays(n: usize, rng: &mut Rng) -> Vec<Ray> {
    (0..n)
        .map(|_| {
            let origin = rng.sphere() * 3.0;
            let target = rng.sphere() * rng.unit();
            Ray::new(origin, (target - origin).normalize())
        })
        .collect()
}

fn strand(hit: Option<Hit>) -> Option<StrandHit> {
    match hit {
        Some(Hit::Strand(hit)) => Some(hit),
        _ => None,
    }
}

/// Entry of a ray into the hull of two spheres: the envelope of all spheres between them, minimised over
/// the position along the axis. Returns `None` on a miss.
fn round_cone(o: DVec3, d: DVec3, a: DVec3, b: DVec3, ra: f64, rb: f64) -> Option<f64> {
    let entry = |s: f64| {
        let c = a + (b - a) * s;
        let r = ra + (rb - ra) * s;
        let z = (c - o).dot(d);
        let d2 = ((c - o) - d * z).length_squared();
        if d2 > r * r { f64::INFINITY } else { z - (r * r - d2).sqrt() }
    };
    let n = 400;
    let best = (0..=n).map(|i| f64::from(i) / f64::from(n)).min_by(|x, y| entry(*x).total_cmp(&entry(*y)))?;
    let (mut lo, mut hi) = ((best - 1.0 / f64::from(n)).max(0.0), (best + 1.0 / f64::from(n)).min(1.0));
    for _ in 0..80 {
        let (m1, m2) = (lo + (hi - lo) / 3.0, hi - (hi - lo) / 3.0);
        if entry(m1) < entry(m2) { hi = m2 } else { lo = m1 }
    }
    let t = entry(0.5 * (lo + hi));
    t.is_finite().then_some(t)
}

#[test]
fn round_strands_agree_with_the_envelope_of_spheres() {
    let mut rng = Rng(1);
    let (p, r, o) = groom(60, 8, 0.02, &mut rng);
    let set = Strands { points: &p, radii: &r, offsets: &o };
    let accel = Accel::build(&[set], &[], &Options { basis: Basis::Linear, ..Options::default() });
    let (mut hits, mut misses, mut rim) = (0, 0, 0);
    for ray in rays(1500, &mut rng) {
        let (origin, dir) = (ray.origin.as_dvec3(), ray.dir.as_dvec3().normalize());
        let mut want: Option<f64> = None;
        for s in 0..o.len() - 1 {
            for i in o[s] as usize..o[s + 1] as usize - 1 {
                let t = round_cone(origin, dir, p[i].as_dvec3(), p[i + 1].as_dvec3(), r[i].into(), r[i + 1].into());
                if let Some(t) = t {
                    want = Some(want.map_or(t, |w: f64| w.min(t)));
                }
            }
        }
        match (want, strand(accel.closest(&ray))) {
            (Some(want), Some(got)) => {
                // At the rim t has a square-root singularity; a thousandth of a radius elsewhere.
                if (f64::from(got.t) - want).abs() < 2e-5 {
                    hits += 1
                } else {
                    rim += 1
                }
                assert!(accel.occluded(&ray));
            }
            (None, None) => {
                misses += 1;
                assert!(!accel.occluded(&ray));
            }
            _ => rim += 1,
        }
    }
    println!("{hits} hits, {misses} misses, {rim} at the rim");
    assert!(hits > 400 && misses > 200);
    // Rays within single precision of the silhouette: a few in a thousand.
    assert!(rim <= 5, "{rim} rays disagree");
}

#[test]
fn ribbons_are_met_where_the_ray_passes_the_axis() {
    let mut rng = Rng(2);
    let (p, r, o) = groom(60, 8, 0.02, &mut rng);
    let set = Strands { points: &p, radii: &r, offsets: &o };
    let options = Options { shape: Shape::Ribbon, basis: Basis::Linear, ..Options::default() };
    let accel = Accel::build(&[set], &[], &options);
    let (mut hits, mut wrong) = (0, 0);
    for ray in rays(4000, &mut rng) {
        let (origin, dir) = (ray.origin.as_dvec3(), ray.dir.as_dvec3().normalize());
        let mut want: Option<f64> = None;
        for s in 0..o.len() - 1 {
            for i in o[s] as usize..o[s + 1] as usize - 1 {
                let (a, b) = (p[i].as_dvec3() - origin, p[i + 1].as_dvec3() - origin);
                let flat = |v: DVec3| v - dir * v.dot(dir);
                let (fa, e) = (flat(a), flat(b - a));
                let s = (-fa.dot(e) / e.length_squared()).clamp(0.0, 1.0);
                let radius = f64::from(r[i]) * (1.0 - s) + f64::from(r[i + 1]) * s;
                if (fa + e * s).length() <= radius {
                    let t = (a + (b - a) * s).dot(dir);
                    want = Some(want.map_or(t, |w: f64| w.min(t)));
                }
            }
        }
        match (want, strand(accel.closest(&ray))) {
            (Some(want), Some(got)) if (f64::from(got.t) - want).abs() < 1e-4 => hits += 1,
            (None, None) => {}
            _ => wrong += 1,
        }
    }
    assert!(hits > 1000 && wrong <= 12, "{hits} hits, {wrong} rays disagree");
}

#[test]
fn triangles_agree_with_brute_force() {
    let mut rng = Rng(3);
    let positions: Vec<Vec3> = (0..600).map(|_| rng.sphere() * rng.unit()).collect();
    let indices: Vec<[u32; 3]> = (0..200).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let accel = Accel::build(&[], &[Triangles { positions: &positions, indices: &indices }], &Options::default());
    let (mut hits, mut wrong) = (0, 0);
    for ray in rays(4000, &mut rng) {
        let (o, d) = (ray.origin.as_dvec3(), ray.dir.as_dvec3().normalize());
        let want = indices
            .iter()
            .filter_map(|t| {
                // Plane, then three half planes: not Möller and Trumbore.
                let [a, b, c] = t.map(|i| positions[i as usize].as_dvec3());
                let n = (b - a).cross(c - a);
                let at = (a - o).dot(n) / d.dot(n);
                let x = o + d * at;
                let inside = [(a, b), (b, c), (c, a)].iter().all(|(p, q)| (*q - *p).cross(x - *p).dot(n) >= 0.0);
                (inside && at > 0.0).then_some(at)
            })
            .min_by(f64::total_cmp);
        match (want, accel.closest(&ray)) {
            (Some(want), Some(Hit::Triangle(got))) if (f64::from(got.t) - want).abs() < 1e-4 => {
                hits += 1;
                // The point lies on the triangle's plane, whatever the distance travelled.
                let a = positions[indices[got.triangle as usize][0] as usize];
                assert!((got.position - a).dot(got.normal).abs() < 2e-6);
            }
            (None, None) => {}
            _ => wrong += 1,
        }
    }
    assert!(hits > 1000 && wrong <= 4, "{hits} hits, {wrong} rays disagree");
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    let mut rng = Rng(4);
    let (p, r, o) = groom(300, 12, 0.01, &mut rng);
    let set = Strands { points: &p, radii: &r, offsets: &o };
    let positions: Vec<Vec3> = (0..300).map(|_| rng.sphere() * rng.unit()).collect();
    let indices: Vec<[u32; 3]> = (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh = Triangles { positions: &positions, indices: &indices };
    let rays = rays(3000, &mut rng);
    let levels = SimdLevel::available();
    // Every x86-64 has two at least: otherwise nothing would be compared here.
    assert!(levels.len() >= if cfg!(target_arch = "x86_64") { 2 } else { 1 });
    for shape in [Shape::Round, Shape::Ribbon] {
        let mut want: Option<Vec<Option<Hit>>> = None;
        for &level in &levels {
            let accel = Accel::build(&[set], &[mesh], &Options { shape, level, ..Options::default() });
            let got: Vec<Option<Hit>> = rays.iter().map(|ray| accel.closest(ray)).collect();
            assert!(got.iter().flatten().count() > 500);
            match &want {
                None => want = Some(got),
                Some(want) => assert!(*want == got, "{level} differs from {}", levels[0]),
            }
        }
    }
    println!("levels compared: {}", levels.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "));
}

#[test]
fn the_build_does_not_depend_on_the_number_of_threads() {
    let mut rng = Rng(9);
    let (p, r, o) = groom(6000, 12, 0.004, &mut rng);
    let set = Strands { points: &p, radii: &r, offsets: &o };
    let rays = rays(500, &mut rng);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let accel = pool.install(|| Accel::build(&[set], &[], &Options::default()));
        (accel.stats(), rays.iter().map(|ray| accel.closest(ray)).collect::<Vec<_>>())
    };
    assert_eq!(run(1), run(3));
}

/// A straight fiber 30 µm thick, 1 m from the origin, in metres.
fn far_fiber() -> Accel {
    let points = [Vec3::new(0.6, -0.05, 0.8), Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.6, 0.06, 0.8)];
    let strands = Strands { points: &points, radii: &[15e-6; 3], offsets: &[0, 3] };
    Accel::build(&[strands], &[], &Options::default())
}

#[test]
fn light_leaves_a_thin_fiber_far_from_the_origin_without_meeting_it_again() {
    let accel = far_fiber();
    let mut rng = Rng(5);
    let mut hits = 0;
    for _ in 0..20_000 {
        // From all around, aimed at all offsets across the fiber.
        let dir = rng.sphere();
        if dir.y.abs() > 0.98 {
            continue;
        }
        let aim = Vec3::new(0.6, 0.1 * (rng.unit() - 0.5) * 0.8, 0.8) + rng.sphere() * 14e-6 * rng.unit();
        let ray = Ray::new(aim - dir * 0.3, dir);
        let Some(hit) = strand(accel.closest(&ray)) else { continue };
        hits += 1;
        for _ in 0..4 {
            let out = rng.sphere();
            let next = Ray { leaving: Some(hit.leave(out)), ..Ray::new(hit.position, out) };
            assert!(accel.closest(&next).is_none(), "met again along {out} from h = {}", hit.h);
            assert!(!accel.occluded(&next));
        }
    }
    assert!(hits > 8_000, "{hits}");
}

#[test]
fn without_the_policy_a_fiber_would_meet_itself() {
    // The guard of the test above: drop the policy and self-hits appear.
    let accel = far_fiber();
    let mut rng = Rng(6);
    let mut again = 0;
    for _ in 0..5_000 {
        let dir = Vec3::new(rng.unit() - 0.5, 0.0, rng.unit() - 0.5).normalize();
        let aim = Vec3::new(0.6, 0.0 + 2e-6 * rng.unit(), 0.8);
        if let Some(hit) = strand(accel.closest(&Ray::new(aim - dir * 0.3, dir))) {
            again += usize::from(accel.occluded(&Ray::new(hit.position, rng.sphere())));
        }
    }
    assert!(again > 10, "{again}");
}

#[test]
fn another_fiber_half_a_diameter_away_is_still_met() {
    // The policy must not swallow neighbours: two parallel fibers 45 µm apart.
    let a = [Vec3::new(0.6, -0.05, 0.8), Vec3::new(0.6, 0.05, 0.8)];
    let b = a.map(|p| p + Vec3::X * 45e-6);
    let points = [a[0], a[1], b[0], b[1]];
    let strands = Strands { points: &points, radii: &[15e-6; 4], offsets: &[0, 2, 4] };
    let accel = Accel::build(&[strands], &[], &Options::default());
    let mut met = 0;
    for i in 0..1000 {
        let z = (f32::from(i as u16) / 999.0 - 0.5) * 2.0 * 13e-6;
        let ray = Ray::new(Vec3::new(0.5, 0.001, 0.8 + z), Vec3::X);
        let first = strand(accel.closest(&ray)).expect("the first fiber is in the way");
        assert_eq!(first.strand, 0);
        let next = Ray { leaving: Some(first.leave(Vec3::X)), ..Ray::new(first.position, Vec3::X) };
        met += usize::from(strand(accel.closest(&next)).is_some_and(|hit| hit.strand == 1));
    }
    assert_eq!(met, 1000);
}

#[test]
fn the_offset_follows_the_rule_of_the_models() {
    // h = -N·t with t = normalize(u × ω_k): uniform over a fiber seen side-on, and of that sign.
    let points = [Vec3::new(0.0, -1.0, 0.0), Vec3::new(0.0, 1.0, 0.0)];
    let strands = Strands { points: &points, radii: &[0.1, 0.1], offsets: &[0, 2] };
    for shape in [Shape::Round, Shape::Ribbon] {
        let accel = Accel::build(&[strands], &[], &Options { shape, ..Options::default() });
        let mut rng = Rng(7);
        for _ in 0..2000 {
            let towards = Vec3::new(rng.unit() - 0.5, 0.6 * (rng.unit() - 0.5), 1.0).normalize();
            let side = Vec3::Y.cross(towards).normalize();
            let x = 0.198 * (rng.unit() - 0.5);
            let ray = Ray::new(towards * 4.0 + side * x, -towards);
            let hit = strand(accel.closest(&ray)).expect("aimed at the fiber");
            // The ray passes on the side of t by x, so the normal has N·t = x / r there.
            assert!((hit.h + x / 0.1).abs() < 2e-3, "{shape:?}: {} for {}", hit.h, x / 0.1);
            if shape == Shape::Round {
                assert!((hit.h + hit.normal.dot(side)).abs() < 5e-3);
                assert!(((hit.position - Vec3::Y * hit.position.y).length() - 0.1).abs() < 1e-5);
            }
        }
    }
}

#[test]
fn curved_strands_have_the_tangent_of_the_curve() {
    // A helix sampled coarsely: hits lie near it and tangents follow it, not the pieces.
    let curve = |u: f32| Vec3::new((6.0 * u).cos(), 3.0 * u, (6.0 * u).sin());
    let n = 25;
    let points: Vec<Vec3> = (0..n).map(|i| curve(i as f32 / (n - 1) as f32)).collect();
    let radii = vec![0.01; n];
    let strands = Strands { points: &points, radii: &radii, offsets: &[0, n as u32] };
    let accel = Accel::build(&[strands], &[], &Options::default());
    let mut rng = Rng(8);
    let mut hits = 0;
    for _ in 0..3000 {
        let u = 0.06 + 0.88 * rng.unit();
        let dir = rng.sphere();
        let target = curve(u);
        let ray = Ray::new(target - dir * 5.0, dir);
        let Some(hit) = strand(accel.closest(&ray)) else { continue };
        let v = hit.u;
        if !(0.045..0.955).contains(&v) {
            // A ray along the coil can meet the end spans, where the curve is not known beyond its ends.
            continue;
        }
        hits += 1;
        let true_tangent = Vec3::new(-6.0 * (6.0 * v).sin(), 3.0, 6.0 * (6.0 * v).cos()).normalize();
        assert!(hit.tangent.dot(true_tangent) > 0.9995, "{}", hit.tangent.dot(true_tangent));
        assert!((hit.position - curve(v)).length() < 0.02);
        assert!(hit.point as usize + 1 < n && (0.0..=1.0).contains(&hit.fraction));
    }
    assert!(hits > 2500, "{hits}");
}

#[test]
fn sets_keep_their_own_indices() {
    let a = [Vec3::ZERO, Vec3::Y, Vec3::X * 3.0, Vec3::X * 3.0 + Vec3::Y];
    let b = [Vec3::X * 6.0, Vec3::X * 6.0 + Vec3::Y];
    let sets = [
        Strands { points: &a, radii: &[0.1; 4], offsets: &[0, 2, 4] },
        Strands { points: &b, radii: &[0.1; 2], offsets: &[0, 2] },
    ];
    let accel = Accel::build(&sets, &[], &Options::default());
    let look = |x: f32| strand(accel.closest(&Ray::new(Vec3::new(x, 0.25, 5.0), -Vec3::Z))).unwrap();
    let (second, third) = (look(3.0), look(6.0));
    assert_eq!((second.set, second.strand, second.point), (0, 1, 2));
    assert_eq!((third.set, third.strand, third.point), (1, 2, 0));
    assert_eq!(accel.first_strand(1), 2);
    assert!((third.u - 0.25).abs() < 1e-3);
}

#[test]
fn nothing_at_all_is_met_by_nothing() {
    let accel = Accel::build(&[], &[], &Options::default());
    assert!(accel.closest(&Ray::new(Vec3::ZERO, Vec3::X)).is_none());
    assert!(accel.bounds().is_none());
}
