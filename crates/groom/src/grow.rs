//! The procedural groomer: a recipe and something to grow on make a groom.
//!
//! A few hundred *guides* are integrated step by step under gravity and comb, outside the skin. Every strand
//! follows a blend of the three guides nearest to its root, never across the parting. Strands then draw together
//! in *clumps*, and clumps in *locks*; locks carry the wave, clumps the curl, strands the frizz. Last, everything
//! is pushed out of the skin.
//!
//! Every random number is a hash of the recipe's seed and of what the number is for, so that a recipe always
//! gives the same groom, and more strands do not change how the guides run.

use std::f32::consts::TAU;
use std::fmt;

use math::{Vec3, hash, lerp, warp};

use crate::{Attribute, Groom, Head};

/// Where on a surface hair grows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scalp {
    /// On the built-in head, behind the hairline of the recipe.
    Head,
    /// On the whole surface, as fur.
    Everywhere,
    /// On the part of the surface that lies higher than this.
    Above(f32),
}

/// How hair grows.
///
/// Lengths are in the unit of the surface, centimetres for the built-in head; bends are in radians per unit of
/// length; shares are from 0 to 1. The defaults are [`wavy_long`](Self::wavy_long).
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    /// Other seeds give other hair of the same kind.
    pub seed: u32,
    /// Number of strands, 1 to 1,000,000; a human head has about 100,000.
    pub strand_count: u32,
    /// Points per strand, 2 to 256; waves need about ten each.
    pub points_per_strand: u32,

    /// Height of the hairline over the forehead. Built-in head only, like everything up to `parting_strength`.
    pub hairline_front: f32,
    /// Height of the hairline at the nape.
    pub hairline_nape: f32,
    /// Half the height over which hair thins out at the hairline, above 0.
    pub hairline_softness: f32,
    /// Where the parting runs: x, positive on the head's own left.
    pub parting: f32,
    /// How strongly hair is combed away from the parting; 0 for none.
    pub parting_strength: f32,

    /// Length of a strand before waves and curls, above 0.
    pub length: f32,
    /// Share by which lengths vary, below 1.
    pub length_variation: f32,
    /// Share by which lengths shrink towards the face and the nape, and at random.
    pub layering: f32,

    /// Bend towards the ground.
    pub gravity: f32,
    /// How much strands stand off the skin at the root: 0 flat, 1 at about half a right angle.
    pub lift: f32,
    /// Thickness of the layer that the hair makes over the skin.
    pub volume: f32,
    /// Direction in which hair is combed; any length but 0.
    pub comb: Vec3,
    /// Length of a strand over which the comb's influence fades to a third, above 0.
    pub comb_length: f32,
    /// How much guides stray from their course.
    pub wander: f32,
    /// Share of the hair at the sides that falls in front of the shoulders. Built-in head only.
    pub over_shoulders: f32,

    /// Number of guides, 1 to 3000.
    pub guide_count: u32,
    /// Number of clumps, 1 to 50,000; eight of them make a lock.
    pub clump_count: u32,
    /// How far strands draw together at the tip.
    pub clump_strength: f32,
    /// Where along the strand they do: 1 evenly from root to tip, less near the root already; above 0.
    pub clump_profile: f32,

    /// Amplitude of the wave.
    pub wave_amplitude: f32,
    /// Length of a wave, above 0.
    pub wave_length: f32,
    /// Share of the strand's length that stays straight before the wave sets in.
    pub wave_start: f32,
    /// Radius of the curl.
    pub curl_radius: f32,
    /// Turns of the curl over the whole length.
    pub curl_turns: f32,
    /// Amplitude of the frizz at the tip.
    pub frizz: f32,
    /// Length of one ripple of the frizz, above 0.
    pub frizz_length: f32,
    /// Share of strands that leave their clump.
    pub flyaways: f32,
    /// How much strands differ from each other: 0 not at all, 1 as hair does.
    pub randomness: f32,

    /// Fiber radius at the root, above 0; human hair has 0.003 to 0.006 centimetres.
    pub root_radius: f32,
    /// Fiber radius at the tip.
    pub tip_radius: f32,
}

impl Default for Recipe {
    fn default() -> Self {
        Self::wavy_long()
    }
}

impl Recipe {
    /// Long, loosely wavy hair, parted a little left of the centre, over and behind the shoulders.
    pub fn wavy_long() -> Self {
        Self {
            seed: 1,
            strand_count: 50_000,
            points_per_strand: 32,
            hairline_front: 6.6,
            hairline_nape: -7.0,
            hairline_softness: 0.5,
            parting: 1.2,
            parting_strength: 0.6,
            length: 42.0,
            length_variation: 0.08,
            layering: 0.5,
            gravity: 0.22,
            lift: 0.45,
            volume: 1.6,
            comb: Vec3::new(0.0, -0.5, -0.55),
            comb_length: 6.0,
            wander: 0.3,
            over_shoulders: 0.55,
            guide_count: 300,
            clump_count: 450,
            clump_strength: 0.93,
            clump_profile: 0.5,
            wave_amplitude: 1.45,
            wave_length: 9.5,
            wave_start: 0.12,
            curl_radius: 0.0,
            curl_turns: 0.0,
            frizz: 0.045,
            frizz_length: 2.0,
            flyaways: 0.02,
            randomness: 1.0,
            root_radius: 0.004,
            tip_radius: 0.002,
        }
    }

    /// Long, sleek, straight hair.
    pub fn straight() -> Self {
        Self {
            points_per_strand: 24,
            length: 44.0,
            length_variation: 0.03,
            layering: 0.3,
            volume: 0.9,
            clump_strength: 0.45,
            wave_amplitude: 0.0,
            frizz: 0.05,
            flyaways: 0.012,
            ..Self::wavy_long()
        }
    }

    /// Short hair, combed aside.
    pub fn short() -> Self {
        Self {
            points_per_strand: 16,
            length: 6.5,
            length_variation: 0.2,
            layering: 0.3,
            gravity: 0.12,
            lift: 0.9,
            volume: 1.2,
            comb_length: 5.0,
            parting_strength: 0.4,
            clump_count: 1600,
            clump_strength: 0.55,
            wave_amplitude: 0.25,
            wave_length: 6.0,
            wave_start: 0.0,
            ..Self::wavy_long()
        }
    }

    /// Voluminous curls to the shoulders.
    pub fn curly() -> Self {
        Self {
            points_per_strand: 72,
            length: 26.0,
            length_variation: 0.12,
            layering: 0.25,
            gravity: 0.11,
            lift: 1.0,
            volume: 3.6,
            clump_count: 1100,
            clump_strength: 0.9,
            clump_profile: 0.35,
            wave_amplitude: 0.0,
            curl_radius: 0.5,
            curl_turns: 7.0,
            frizz: 0.2,
            flyaways: 0.04,
            ..Self::wavy_long()
        }
    }

    /// Short, dense fur, combed backwards; meant for [`Scalp::Everywhere`].
    pub fn fur() -> Self {
        Self {
            strand_count: 200_000,
            points_per_strand: 8,
            parting_strength: 0.0,
            length: 2.2,
            length_variation: 0.25,
            layering: 0.2,
            gravity: 0.15,
            lift: 0.7,
            volume: 0.8,
            comb: Vec3::new(0.0, -0.4, -1.0),
            comb_length: 4.0,
            guide_count: 1500,
            clump_count: 6000,
            clump_strength: 0.5,
            clump_profile: 1.2,
            wave_amplitude: 0.0,
            frizz: 0.04,
            frizz_length: 0.8,
            root_radius: 0.003,
            tip_radius: 0.0005,
            ..Self::wavy_long()
        }
    }

    fn validate(&self) -> Result<(), GrowError> {
        let tiny = f32::MIN_POSITIVE;
        let big = 1e6;
        let checks = [
            ("strand_count", self.strand_count as f32, 1.0, 1e6),
            ("points_per_strand", self.points_per_strand as f32, 2.0, 256.0),
            ("hairline_front", self.hairline_front, -big, big),
            ("hairline_nape", self.hairline_nape, -big, big),
            ("hairline_softness", self.hairline_softness, tiny, big),
            ("parting", self.parting, -big, big),
            ("parting_strength", self.parting_strength, 0.0, 100.0),
            ("length", self.length, 1e-6, big),
            ("length_variation", self.length_variation, 0.0, 0.99),
            ("layering", self.layering, 0.0, 1.0),
            ("gravity", self.gravity, -big, big),
            ("lift", self.lift, 0.0, 100.0),
            ("volume", self.volume, 0.0, big),
            ("the length of comb", self.comb.length(), 1e-6, big),
            ("comb_length", self.comb_length, tiny, big),
            ("wander", self.wander, 0.0, 100.0),
            ("over_shoulders", self.over_shoulders, 0.0, 1.0),
            ("guide_count", self.guide_count as f32, 1.0, 3000.0),
            ("clump_count", self.clump_count as f32, 1.0, 50_000.0),
            ("clump_strength", self.clump_strength, 0.0, 1.0),
            ("clump_profile", self.clump_profile, 0.01, 100.0),
            ("wave_amplitude", self.wave_amplitude, 0.0, big),
            ("wave_length", self.wave_length, 1e-6, big),
            ("wave_start", self.wave_start, 0.0, 1.0),
            ("curl_radius", self.curl_radius, 0.0, big),
            ("curl_turns", self.curl_turns, 0.0, 1e4),
            ("frizz", self.frizz, 0.0, big),
            ("frizz_length", self.frizz_length, 1e-6, big),
            ("flyaways", self.flyaways, 0.0, 1.0),
            ("randomness", self.randomness, 0.0, 10.0),
            ("root_radius", self.root_radius, tiny, big),
            ("tip_radius", self.tip_radius, 0.0, big),
        ];
        for (name, found, least, most) in checks {
            if !(least..=most).contains(&found) {
                return Err(GrowError::Value { name, found, least, most });
            }
        }
        let points = u64::from(self.strand_count) * u64::from(self.points_per_strand);
        if points > MOST_POINTS {
            return Err(GrowError::TooManyPoints { found: points });
        }
        Ok(())
    }
}

/// More points than this are refused: they would take gigabytes.
const MOST_POINTS: u64 = 100_000_000;

/// Why nothing was grown.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum GrowError {
    /// A field of the recipe is out of range.
    Value {
        /// The field.
        name: &'static str,
        /// Its value.
        found: f32,
        /// The least allowed.
        least: f32,
        /// The greatest allowed.
        most: f32,
    },
    /// Strands times points are more than 100 million.
    TooManyPoints {
        /// Their number.
        found: u64,
    },
    /// The mesh has missing vertices, or positions or normals that are not finite.
    Mesh(crate::MeshError),
    /// No part of the surface may bear hair.
    Bare,
    /// The recipe's numbers, each allowed, together led to positions that are not finite.
    Unstable,
}

impl fmt::Display for GrowError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Value { name, found, least, most } => {
                write!(f, "{name} is {found}; it must be from {least} to {most}")
            }
            Self::TooManyPoints { found } => {
                write!(f, "{found} points are more than {MOST_POINTS}; take fewer strands or fewer points each")
            }
            Self::Mesh(e) => write!(f, "hair cannot grow on this mesh: {e}"),
            Self::Bare => write!(f, "no part of the surface may bear hair; check the hairline"),
            Self::Unstable => write!(f, "the recipe's numbers lead to positions that are not finite"),
        }
    }
}

impl std::error::Error for GrowError {}

/// Grows a groom: a pure function of the recipe and the surface.
///
/// Strands get radii and the attributes `root_uv` (azimuth and height of the root as shares of the whole, and 0),
/// `clump` (its number) and `random` (a number in `[0, 1)`), all per strand.
///
/// # Errors
/// When a value of the recipe is out of range, the mesh is broken, or nothing of it may bear hair.
pub fn grow(recipe: &Recipe, head: &Head) -> Result<Groom, GrowError> {
    recipe.validate()?;
    head.mesh.validate().map_err(GrowError::Mesh)?;
    let longest = recipe.length * (1.0 + recipe.length_variation);
    let groomer = Groomer { recipe, head, longest, step: longest / (STEPS - 1) as f32 };
    let (roots, area) = groomer.roots()?;
    let guides = groomer.guides(&roots, area);
    let clumps = groomer.clumps(&roots, &guides);
    groomer.strands(&roots, &guides, &clumps)
}

/// Points of a guide and of a clump's course.
const STEPS: usize = 48;

/// What the streams of random numbers are for.
#[derive(Clone, Copy)]
enum Use {
    Root = 1,
    RootPlace,
    GuidePick,
    GuideDrape,
    GuideLayer,
    GuideWander,
    LockPick,
    ClumpPick,
    Phase,
    Scale,
    Parting,
    Flyaway,
    Random,
    Length,
    Layering,
    Height,
    Pull,
    Jitter,
    FlyLength,
    FlyAway,
    FrizzStart,
    Frizz,
}

/// Where a strand begins.
#[derive(Clone, Copy)]
struct Root {
    place: Vec3,
    normal: Vec3,
    /// Which side of the parting: -1 or 1; 0 where there is none.
    side: f32,
}

/// The courses of all guides.
struct Guides {
    seeds: Seeds,
    /// `STEPS` points each.
    points: Vec<Vec3>,
    /// Distance² at which guides begin to share their influence evenly.
    blur: f32,
}

/// How a strand follows the guides around it.
struct Course {
    root: Vec3,
    /// Guides and their weights, which add up to 1.
    parts: [(usize, f32); 3],
}

/// A bundle of strands.
struct Clump {
    phase: f32,
    scale: f32,
    wave: Wave,
}

/// The wave of a lock, as one of its clumps has it.
#[derive(Clone, Copy)]
struct Wave {
    amplitude: f32,
    frequency: f32,
    phase: f32,
    start: f32,
    full: f32,
}

/// The clumps' courses, their frames across the course, and where they root.
struct Clumps {
    seeds: Seeds,
    clumps: Vec<Clump>,
    /// `STEPS` points each, with the wave.
    points: Vec<Vec3>,
    /// Unit vectors across each course, away from the skin at the root.
    outward: Vec<Vec3>,
    /// Unit vectors across each course and `outward`.
    sideward: Vec<Vec3>,
}

struct Groomer<'a> {
    recipe: &'a Recipe,
    head: &'a Head,
    longest: f32,
    /// Length of a guide's segment.
    step: f32,
}

impl Groomer<'_> {
    fn stream(&self, of: Use) -> u32 {
        hash::mix2(self.recipe.seed, of as u32)
    }

    fn unit(&self, index: usize, of: Use) -> f32 {
        hash::unit(index as u32, self.stream(of))
    }

    fn signed(&self, index: usize, of: Use) -> f32 {
        hash::signed(index as u32, self.stream(of))
    }

    fn on_head(&self) -> bool {
        self.head.scalp == Scalp::Head
    }

    /// How dense hair grows at a place of the surface, 0 to 1.
    fn density(&self, p: Vec3) -> f32 {
        match self.head.scalp {
            Scalp::Everywhere => 1.0,
            Scalp::Above(height) => f32::from(p.y > height),
            // Neck, shoulders and chest are below.
            Scalp::Head if p.y < -10.0 => 0.0,
            Scalp::Head => {
                let soft = self.recipe.hairline_softness;
                smoothstep(-soft, soft, p.y - self.hairline(p))
            }
        }
    }

    /// Height of the built-in head's hairline in the direction of `p`: across the forehead, down the sideburns,
    /// around the ears and down to the nape.
    fn hairline(&self, p: Vec3) -> f32 {
        let (front, nape) = (self.recipe.hairline_front, self.recipe.hairline_nape);
        let knots = [
            (0.0, front),
            (30.0, front + 0.1),
            (55.0, front - 1.6),
            (70.0, 1.5),
            (76.0, 0.3),
            (82.0, 2.2),
            (102.0, 2.2),
            (112.0, -1.0),
            (130.0, nape + 2.5),
            (180.0, nape),
        ];
        let azimuth = p.x.atan2(p.z + 1.0).abs().to_degrees();
        knots
            .windows(2)
            .find(|w| azimuth <= w[1].0)
            .map_or(nape, |w| lerp(w[0].1, w[1].1, smoothstep(w[0].0, w[1].0, azimuth)))
    }

    /// 1 where the parting separates, 0 at the back of the head.
    fn frontness(&self, p: Vec3) -> f32 {
        if self.on_head() { smoothstep(-5.0, -1.0, p.z) } else { 0.0 }
    }

    fn side(&self, p: Vec3) -> f32 {
        if self.frontness(p) <= 0.0 || self.recipe.parting_strength == 0.0 {
            return 0.0;
        }
        // Nobody parts hair with a ruler.
        let line = self.recipe.parting + 0.35 * hash::noise_1d(0.8 * p.z, self.stream(Use::Parting));
        if p.x < line { -1.0 } else { 1.0 }
    }

    /// Roots spread evenly over the scalp, and the scalp's area.
    fn roots(&self) -> Result<(Vec<Root>, f32), GrowError> {
        let mesh = &self.head.mesh;
        let normals = mesh.vertex_normals();
        let mut cumulative = Vec::with_capacity(mesh.triangles.len());
        let mut total = 0.0_f64;
        for t in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(t);
            let area = 0.5 * (b - a).cross(c - a).length();
            total += f64::from(area * self.density((a + b + c) / 3.0));
            cumulative.push(total);
        }
        if !(total > 0.0 && total.is_finite()) {
            return Err(GrowError::Bare);
        }
        let count = self.recipe.strand_count as usize;
        let mut roots = Vec::with_capacity(count);
        for i in 0..count {
            // One root per stratum of the area; inside a triangle, a sequence that fills the square evenly.
            let jitter = f64::from(self.unit(i, Use::Root));
            let at = (i as f64 + jitter) / count as f64 * total;
            let t = cumulative.partition_point(|&c| c <= at).min(mesh.triangles.len() - 1);
            let turn = f64::from(self.unit(0, Use::RootPlace));
            let place = [
                (i as f64 * 0.754_877_666_246_693 + turn).fract() as f32,
                (i as f64 * 0.569_840_290_998_053 + turn).fract() as f32,
            ];
            let [wa, wb, wc] = warp::triangle(place);
            let [a, b, c] = mesh.corners(t);
            let [na, nb, nc] = mesh.triangles[t].map(|v| normals[v as usize]);
            let place = a * wa + b * wb + c * wc;
            let normal = (na * wa + nb * wb + nc * wc).normalize_or(Vec3::Y);
            roots.push(Root { place, normal, side: self.side(place) });
        }
        Ok((roots, total as f32))
    }

    /// `count` of the roots, far from each other.
    fn pick(&self, roots: &[Root], count: u32, of: Use) -> Vec<usize> {
        let count = count as usize;
        let n = roots.len();
        let stratified =
            |i: usize| (((i as f64 + f64::from(self.unit(i, of))) / count as f64 * n as f64) as usize).min(n - 1);
        if count > 3000 {
            // Keeping apart costs the square of the count; so many are even enough by area alone.
            return (0..count).map(stratified).collect();
        }
        let mut picked: Vec<usize> = Vec::with_capacity(count);
        for i in 0..count {
            // Of a few candidates the one farthest from all others.
            let mut best = (-1.0, 0);
            for k in 0..6 {
                let candidate = ((self.unit(8 * i + k, of) * n as f32) as usize).min(n - 1);
                let r = roots[candidate];
                let nearest = picked
                    .iter()
                    .map(|&j| {
                        let other = roots[j];
                        let apart = if r.side * other.side < 0.0 { f32::MAX } else { 0.0 };
                        r.place.distance_squared(other.place).max(apart)
                    })
                    .fold(f32::MAX, f32::min);
                if nearest > best.0 {
                    best = (nearest, candidate);
                }
            }
            picked.push(best.1);
        }
        picked
    }

    fn guides(&self, roots: &[Root], area: f32) -> Guides {
        let picked = self.pick(roots, self.recipe.guide_count, Use::GuidePick);
        let mut points = Vec::with_capacity(picked.len() * STEPS);
        for (i, &id) in picked.iter().enumerate() {
            self.integrate(i, &roots[id], &mut points);
        }
        let seeds = Seeds::new(picked.iter().map(|&id| roots[id]).collect());
        Guides { seeds, points, blur: 0.075 * area / self.recipe.guide_count as f32 }
    }

    /// One guide, step by step: its direction bends under gravity, comb and chance, and its place stays outside
    /// the layer of hair below it.
    fn integrate(&self, guide: usize, root: &Root, points: &mut Vec<Vec3>) {
        let recipe = self.recipe;
        let front = self.frontness(root.place);
        let layer = recipe.volume * (0.35 + 0.5 * self.unit(guide, Use::GuideLayer));
        // Away from the parting, most of all beside it; at the back, away from the middle.
        let mut aside = 0.0;
        if self.on_head() {
            let beside = front * (-((root.place.x - recipe.parting) / 2.5).powi(2)).exp();
            let outward = lerp(0.6 * (root.place.x / 6.0).clamp(-1.0, 1.0), root.side, front);
            aside = outward * (0.35 + recipe.parting_strength * beside);
        }
        let comb = (recipe.comb + Vec3::X * aside).normalize_or_zero();
        let along = (comb - root.normal * comb.dot(root.normal)).normalize_or_zero();
        let mut direction = (root.normal * recipe.lift + along).normalize_or(root.normal);
        // In front of the shoulders or behind them.
        let divide = lerp(4.5, -3.0, recipe.over_shoulders);
        let drape = (0.5 * (root.place.z - divide) + 0.6 * self.signed(guide, Use::GuideDrape)).tanh();

        let mut p = root.place;
        points.push(p);
        let mut arc = 0.0;
        for k in 1..STEPS {
            arc += self.step;
            let skin = self.head.collider.gradient(p).normalize_or_zero();
            let mut force = Vec3::NEG_Y * recipe.gravity;
            let combing = 1.2 * recipe.gravity.abs() * (-arc / recipe.comb_length).exp();
            force += (comb - skin * comb.dot(skin)) * combing;
            let w = 3 * (guide * STEPS + k);
            let chance = [w, w + 1, w + 2].map(|i| self.signed(i, Use::GuideWander));
            force += Vec3::from_array(chance) * (0.12 * recipe.wander);
            if self.on_head() {
                let shoulders = smoothstep(-4.0, -12.0, p.y) * smoothstep(-30.0, -24.0, p.y);
                force += Vec3::new(-0.01 * p.x, 0.0, drape) * (0.9 * recipe.gravity * shoulders);
                // What would hang into the face is swept aside.
                let face = smoothstep(2.0, 6.0, p.z)
                    * smoothstep(-14.0, -9.0, p.y)
                    * smoothstep(8.5, 5.0, p.x.abs())
                    * smoothstep(9.0, 4.0, p.y);
                force += Vec3::new(0.9_f32.copysign(p.x), 0.0, -0.7) * (1.6 * recipe.gravity * face);
            }
            direction = (direction + force * self.step).normalize_or(direction);
            let mut next = p + direction * self.step;
            // Strands rise to their layer over a few lengths of it, not at once.
            let wanted = layer.min(self.clearance() + 0.5 * arc);
            let (distance, gradient) = self.head.collider.sample(next);
            if distance < wanted {
                next += gradient.normalize_or_zero() * (wanted - distance);
            }
            direction = (next - p).normalize_or(direction);
            p += direction * self.step;
            points.push(p);
        }
    }

    /// The least distance from the skin that is worth keeping.
    fn clearance(&self) -> f32 {
        1e-3 * self.recipe.length
    }

    fn course(&self, root: &Root, guides: &Guides) -> Course {
        let found = guides.seeds.nearest::<3>(root.place, root.side);
        let mut parts = found.map(|(id, d)| (id as usize, 1.0 / (d + guides.blur)));
        for (part, (id, _)) in parts.iter_mut().zip(found) {
            if id == NOBODY {
                *part = (0, 0.0);
            }
        }
        let sum: f32 = parts.iter().map(|p| p.1).sum();
        for part in &mut parts {
            // Where nobody is on this side, the strand follows guide 0 rather than nothing.
            part.1 = if sum > 0.0 { part.1 / sum } else { 1.0 / 3.0 };
        }
        Course { root: root.place, parts }
    }

    /// The segment of a course, counted from its root, that `arc` lies on, and how far along.
    fn segment(&self, arc: f32) -> (usize, f32) {
        let x = arc / self.step;
        let i = (x as usize).min(STEPS - 2);
        (i, x - i as f32)
    }

    /// Where a course is after `arc` of its length.
    fn follow(&self, course: &Course, guides: &Guides, arc: f32) -> Vec3 {
        let (i, t) = self.segment(arc);
        let mut p = course.root;
        for (guide, weight) in course.parts {
            let points = &guides.points[guide * STEPS..(guide + 1) * STEPS];
            p += (points[i].lerp(points[i + 1], t) - points[0]) * weight;
        }
        p
    }

    /// How far strands have drawn together at a share of the longest length.
    fn profile(&self, share: f32) -> f32 {
        share.clamp(0.0, 1.0).powf(self.recipe.clump_profile)
    }

    fn clumps(&self, roots: &[Root], guides: &Guides) -> Clumps {
        let recipe = self.recipe;
        let locks = self.pick(roots, recipe.clump_count.div_ceil(8), Use::LockPick);
        let lock_points: Vec<Vec3> = locks
            .iter()
            .flat_map(|&id| {
                let course = self.course(&roots[id], guides);
                (0..STEPS).map(move |k| self.follow(&course, guides, k as f32 * self.step))
            })
            .collect();
        let lock_seeds = Seeds::new(locks.iter().map(|&id| roots[id]).collect());

        let picked = self.pick(roots, recipe.clump_count, Use::ClumpPick);
        let total = picked.len() * STEPS;
        let mut clumps = Vec::with_capacity(picked.len());
        let (mut points, mut outward, mut sideward) =
            (Vec::with_capacity(total), Vec::with_capacity(total), Vec::with_capacity(total));
        for (i, &id) in picked.iter().enumerate() {
            let root = &roots[id];
            let course = self.course(root, guides);
            // Where no lock is on this side of the parting, the clump is its own.
            let [(lock, _)] = lock_seeds.nearest::<1>(root.place, root.side);
            let parent = (lock != NOBODY).then_some(lock as usize);
            let lock_id = parent.unwrap_or(locks.len() + i);
            let lock_root = parent.map_or(root.place, |l| roots[locks[l]].place);
            let (phase, scale) = (self.unit(i, Use::Phase), self.unit(i, Use::Scale));
            let lock_scale = self.unit(100_000 + lock_id, Use::Scale);

            let mut line = [Vec3::ZERO; STEPS];
            for (k, p) in line.iter_mut().enumerate() {
                let arc = k as f32 * self.step;
                *p = self.follow(&course, guides, arc);
                if let Some(l) = parent {
                    let pull =
                        0.75 * recipe.clump_strength * self.profile(1.15 * arc / self.longest) * (0.55 + 0.45 * scale);
                    *p = p.lerp(lock_points[l * STEPS + k], pull);
                }
            }
            // Neighbouring locks wave nearly in step, which is what makes a wave of hair and not of strands.
            let in_step = 0.28 * TAU * self.unit(100_000 + lock_id, Use::Phase)
                + (0.35 * lock_root.z + 0.2 * lock_root.y) * 12.0 / recipe.wave_length;
            let wave = Wave {
                amplitude: recipe.wave_amplitude * (0.6 + 0.6 * lock_scale),
                frequency: TAU / (recipe.wave_length * (0.85 + 0.3 * lock_scale)),
                phase: in_step + 1.3 * (phase - 0.5),
                start: recipe.wave_start * recipe.length,
                full: (recipe.wave_start + 0.22) * recipe.length,
            };
            // A frame that turns as little as it can along the course.
            let mut across = root.normal;
            for k in 0..STEPS {
                let tangent = (line[(k + 1).min(STEPS - 1)] - line[k.saturating_sub(1)]).normalize_or(root.normal);
                let flat = across - tangent * across.dot(tangent);
                across = flat.try_normalize().unwrap_or_else(|| tangent.any_orthonormal_vector());
                let side = tangent.cross(across);
                points.push(line[k] + wave.offset(k as f32 * self.step, 0.0, across, side));
                outward.push(across);
                sideward.push(side);
            }
            clumps.push(Clump { phase: TAU * phase, scale, wave });
        }
        let seeds = Seeds::new(picked.iter().map(|&id| roots[id]).collect());
        Clumps { seeds, clumps, points, outward, sideward }
    }

    fn strands(&self, roots: &[Root], guides: &Guides, clumps: &Clumps) -> Result<Groom, GrowError> {
        let recipe = self.recipe;
        let per_strand = recipe.points_per_strand as usize;
        let mut points = Vec::with_capacity(roots.len() * per_strand);
        let mut clump_numbers = Vec::with_capacity(roots.len());
        let mut randoms = Vec::with_capacity(roots.len());
        for (s, root) in roots.iter().enumerate() {
            let clump = self.strand(s, root, guides, clumps, &mut points);
            clump_numbers.push(clump as f32);
            randoms.push(self.unit(s, Use::Random));
        }
        let (low, high) = self.head.mesh.bounds().unwrap_or_default();
        let (middle, height) = (0.5 * (low + high), (high.y - low.y).max(f32::MIN_POSITIVE));
        let root_uv = roots
            .iter()
            .map(|r| {
                let d = r.place - middle;
                [d.x.atan2(d.z) / TAU + 0.5, (r.place.y - low.y) / height, 0.0]
            })
            .collect();

        let counts = std::iter::repeat_n(recipe.points_per_strand, roots.len());
        let mut groom = Groom::new(points, counts).map_err(|_| GrowError::Unstable)?;
        groom.metres_per_unit = self.head.metres_per_unit;
        // Hair is even for most of its length and thins out towards the tip.
        let taper = |u: f32| lerp(recipe.root_radius, recipe.tip_radius, smoothstep(0.5, 1.0, u));
        groom.set_radius_profile(taper).map_err(|_| GrowError::Unstable)?;
        for (name, attribute) in [
            ("root_uv", Attribute::strand_vectors(root_uv)),
            ("clump", Attribute::strand_floats(clump_numbers)),
            ("random", Attribute::strand_floats(randoms)),
        ] {
            groom.attributes.insert(name, attribute).map_err(|_| GrowError::Unstable)?;
        }
        Ok(groom)
    }

    /// Appends one strand; returns its clump.
    fn strand(&self, s: usize, root: &Root, guides: &Guides, clumps: &Clumps, points: &mut Vec<Vec3>) -> usize {
        let recipe = self.recipe;
        let course = self.course(root, guides);
        let [(found, _)] = clumps.seeds.nearest::<1>(root.place, root.side);
        let c = if found == NOBODY { 0 } else { found as usize };
        let clump = &clumps.clumps[c];
        let at = c * STEPS;

        let flyaway = self.unit(s, Use::Flyaway) < recipe.flyaways;
        let random = self.unit(s, Use::Random);
        let length = self.length(s, root, flyaway);
        let height = recipe.volume * recipe.randomness * self.unit(s, Use::Height).powf(1.5);
        let strength = recipe.clump_strength * if flyaway { 0.5 } else { 1.0 } * (0.7 + 0.3 * self.unit(s, Use::Pull));
        let jitter = 0.5 * recipe.randomness * self.signed(s, Use::Jitter);
        let ramp_end = 0.1 * recipe.length;
        let curl_frequency = TAU * recipe.curl_turns / recipe.length * (0.85 + 0.3 * clump.scale);
        let curl_radius = recipe.curl_radius * (0.8 + 0.4 * random);
        let frizz = recipe.frizz * recipe.randomness * if flyaway { 3.5 } else { 0.6 + 0.8 * random };
        let frizz_stream = hash::mix2(self.stream(Use::Frizz), s as u32);
        let frizz_start = 64.0 * self.unit(s, Use::FrizzStart);
        let away = [3 * s, 3 * s + 1, 3 * s + 2].map(|i| self.signed(i, Use::FlyAway));
        let away = (Vec3::from_array(away) + Vec3::Y * 0.3) * (0.03 * recipe.length);

        let last = (recipe.points_per_strand - 1) as f32;
        for k in 0..recipe.points_per_strand {
            if k == 0 {
                // A little below the skin, so that no gap shows.
                points.push(root.place - root.normal * self.clearance());
                continue;
            }
            let u = k as f32 / last;
            let arc = u * length;
            let (i, t) = self.segment(arc);
            let centre = clumps.points[at + i].lerp(clumps.points[at + i + 1], t);
            let outward = clumps.outward[at + i].lerp(clumps.outward[at + i + 1], t);
            let sideward = clumps.sideward[at + i].lerp(clumps.sideward[at + i + 1], t);
            let ramp = smoothstep(0.0, ramp_end, arc);

            let mut p = self.follow(&course, guides, arc) + outward * (0.8 * height * ramp);
            let pull = (strength * self.profile(1.35 * arc / self.longest + 0.02)).min(0.97);
            // The centre already waves; every strand waves in full, however far it is pulled.
            let own = clump.wave.offset(arc, jitter, outward, sideward);
            let common = clump.wave.offset(arc, 0.0, outward, sideward);
            p = (p + own).lerp(centre - common + own, pull);
            if curl_radius > 0.0 {
                let (sin, cos) = (curl_frequency * arc + clump.phase + jitter).sin_cos();
                p += (sideward * cos + outward * sin) * (curl_radius * ramp);
            }
            if frizz > 0.0 {
                let x = arc / recipe.frizz_length + frizz_start;
                let amplitude = frizz * (0.2 + 0.8 * u) * ramp;
                p += outward * (amplitude * hash::noise_1d(x, frizz_stream))
                    + sideward * (amplitude * hash::noise_1d(x, frizz_stream.wrapping_add(1)));
            }
            if flyaway {
                p += away * (u * u);
            }
            // Strands of higher layers keep above those of lower ones.
            let margin = self.clearance() + 0.25 * height * (0.5 * arc).min(1.0);
            points.push(self.head.collider.push_out(p, margin));
        }
        c
    }

    /// Length of a strand before waves and curls.
    fn length(&self, s: usize, root: &Root, flyaway: bool) -> f32 {
        let recipe = self.recipe;
        let mut shorter = 0.25 * self.unit(s, Use::Layering);
        if self.on_head() {
            let back = smoothstep(4.0, -6.0, root.place.z);
            shorter += 0.45 * (1.0 - back) + 0.55 * back * smoothstep(4.0, -7.0, root.place.y);
        }
        let broken = if flyaway { 0.55 + 0.4 * self.unit(s, Use::FlyLength) } else { 1.0 };
        recipe.length
            * (1.0 + recipe.length_variation * self.signed(s, Use::Length))
            * (1.0 - recipe.layering * shorter)
            * broken
    }
}

impl Wave {
    /// Displacement after `arc` of the length: mostly sideways, a little in and out.
    #[inline]
    fn offset(&self, arc: f32, ahead: f32, outward: Vec3, sideward: Vec3) -> Vec3 {
        if self.amplitude == 0.0 {
            return Vec3::ZERO;
        }
        let (sin, cos) = (self.frequency * arc + self.phase + ahead).sin_cos();
        (sideward * sin + outward * (0.45 * cos)) * (self.amplitude * smoothstep(self.start, self.full, arc))
    }
}

/// The number that stands for no seed.
const NOBODY: u32 = u32::MAX;

/// Roots of guides or clumps, sorted into cells so that the nearest are found without asking all.
struct Seeds {
    roots: Vec<Root>,
    low: Vec3,
    cell: f32,
    dims: [usize; 3],
    /// Seeds of cell `c`: `order[starts[c]..starts[c + 1]]`.
    starts: Vec<u32>,
    order: Vec<u32>,
}

impl Seeds {
    fn new(roots: Vec<Root>) -> Self {
        let first = roots.first().map_or(Vec3::ZERO, |r| r.place);
        let (low, high) = roots.iter().fold((first, first), |(lo, hi), r| (lo.min(r.place), hi.max(r.place)));
        let size = high - low;
        // Seeds lie on a surface: of n³ cells about n² are used.
        let per_side = ((roots.len() as f32 / 3.0).sqrt() as usize).clamp(1, 64);
        let cell = (size.max_element() / per_side as f32).max(f32::MIN_POSITIVE);
        let dims = size.to_array().map(|s| ((s / cell) as usize).min(per_side) + 1);
        let mut seeds = Self { roots, low, cell, dims, starts: Vec::new(), order: Vec::new() };
        let cells: Vec<usize> = seeds.roots.iter().map(|r| seeds.index(seeds.cell_of(r.place))).collect();
        let mut starts = vec![0_u32; dims[0] * dims[1] * dims[2] + 1];
        for &c in &cells {
            starts[c + 1] += 1;
        }
        for c in 1..starts.len() {
            starts[c] += starts[c - 1];
        }
        let mut next = starts.clone();
        let mut order = vec![0_u32; cells.len()];
        for (seed, &c) in cells.iter().enumerate() {
            order[next[c] as usize] = seed as u32;
            next[c] += 1;
        }
        seeds.starts = starts;
        seeds.order = order;
        seeds
    }

    fn cell_of(&self, p: Vec3) -> [usize; 3] {
        let local = ((p - self.low) / self.cell).to_array();
        // The cast saturates below 0.
        [0, 1, 2].map(|k| (local[k] as usize).min(self.dims[k] - 1))
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.dims[1] + y) * self.dims[0] + x
    }

    /// The `N` seeds nearest to `p` that are not across the parting, with their squared distances, nearest
    /// first; [`NOBODY`] fills up.
    fn nearest<const N: usize>(&self, p: Vec3, side: f32) -> [(u32, f32); N] {
        let mut best = [(NOBODY, f32::INFINITY); N];
        let centre = self.cell_of(p);
        let widest = self.dims.into_iter().max().unwrap_or(1);
        for ring in 0..=widest {
            // Everything within `ring - 1` cells of `p` has been seen.
            let seen = self.cell * ring.saturating_sub(1) as f32;
            if ring > 1 && best[N - 1].1 <= seen * seen {
                break;
            }
            let low = centre.map(|c| c.saturating_sub(ring));
            let high = [0, 1, 2].map(|k| (centre[k] + ring).min(self.dims[k] - 1));
            for z in low[2]..=high[2] {
                for y in low[1]..=high[1] {
                    let shell = z.abs_diff(centre[2]) == ring || y.abs_diff(centre[1]) == ring;
                    for x in low[0]..=high[0] {
                        if shell || x.abs_diff(centre[0]) == ring {
                            self.compare([x, y, z], p, side, &mut best);
                        }
                    }
                }
            }
        }
        best
    }

    /// Sorts the seeds of one cell into `best`.
    fn compare<const N: usize>(&self, cell: [usize; 3], p: Vec3, side: f32, best: &mut [(u32, f32); N]) {
        let c = self.index(cell);
        for &seed in &self.order[self.starts[c] as usize..self.starts[c + 1] as usize] {
            let root = &self.roots[seed as usize];
            let d = root.place.distance_squared(p);
            if root.side * side < 0.0 || d >= best[N - 1].1 {
                continue;
            }
            let mut k = N - 1;
            while k > 0 && best[k - 1].1 > d {
                best[k] = best[k - 1];
                k -= 1;
            }
            best[k] = (seed, d);
        }
    }
}

/// Hermite step from 0 at `a` to 1 at `b`.
fn smoothstep(a: f32, b: f32, x: f32) -> f32 {
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use super::*;
    use crate::{Mesh, Report, mannequin};

    static HEAD: LazyLock<Head> = LazyLock::new(mannequin);

    fn small(recipe: Recipe) -> Recipe {
        Recipe { strand_count: 1000, ..recipe }
    }

    #[test]
    fn a_recipe_always_gives_the_same_groom_and_another_seed_another() {
        let recipe = small(Recipe::wavy_long());
        let (a, b) = (grow(&recipe, &HEAD).unwrap(), grow(&recipe, &HEAD).unwrap());
        assert_eq!(a, b);
        let other = grow(&Recipe { seed: 2, ..recipe }, &HEAD).unwrap();
        assert_eq!(other.point_count(), a.point_count());
        assert_ne!(a.points(), other.points());
    }

    #[test]
    fn every_preset_stays_outside_the_head() {
        for recipe in [Recipe::wavy_long(), Recipe::straight(), Recipe::short(), Recipe::curly(), Recipe::fur()] {
            let groom = grow(&small(recipe.clone()), &HEAD).unwrap();
            assert_eq!(groom.strand_count(), 1000);
            assert!(groom.strands().all(|s| s.len() == recipe.points_per_strand as usize));
            let deep = groom.points().iter().filter(|p| HEAD.collider.distance(**p) < -0.1).count();
            assert!(deep * 100 <= groom.point_count(), "{deep} of {} are inside", groom.point_count());
            let radius = groom.radius.as_ref().unwrap();
            // Interpolation may miss the tip's radius by a rounding.
            assert!(radius.iter().all(|r| (0.999 * recipe.tip_radius..=recipe.root_radius).contains(r)));
            assert_eq!(groom.metres_per_unit, Some(0.01));
            for name in ["clump", "random"] {
                assert!(groom.attributes.float(name, 999, 0, 0.0).is_some());
            }
            let [u, v, w] = groom.attributes.vec3("root_uv", 0, 0, 0.0).unwrap();
            assert!((0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v) && w == 0.0);
        }
    }

    #[test]
    fn lengths_are_what_was_asked_for() {
        // Layering takes up to 80 % of its share, flyaways are off; what remains is the blending of guides,
        // which may cut corners, and the push out of the skin, which may add some.
        let recipe = Recipe { flyaways: 0.0, frizz: 0.0, ..small(Recipe::straight()) };
        let report = Report::of(&grow(&recipe, &HEAD).unwrap());
        let longest = recipe.length * (1.0 + recipe.length_variation);
        let shortest = recipe.length * (1.0 - recipe.length_variation) * (1.0 - 0.8 * recipe.layering);
        assert!(report.length.max < 1.2 * longest, "{report}");
        assert!(report.length.min > 0.6 * shortest, "{report}");
        assert!(report.length.mean > 0.85 * shortest && report.length.mean < 1.05 * longest, "{report}");
    }

    #[test]
    fn hair_grows_on_the_scalp_and_falls() {
        let groom = grow(&small(Recipe::wavy_long()), &HEAD).unwrap();
        for strand in groom.strands() {
            let root = strand[0];
            // Softness spans half a centimetre, triangles another third.
            assert!(root.y > -8.0, "{root} is below the nape");
            assert!(root.z < 4.0 || root.y > 4.5, "{root} is in the face");
        }
        assert_eq!(crate::guess_up(&groom), Some(crate::UpAxis::Y));
    }

    #[test]
    fn fur_covers_a_ball_evenly() {
        let ball = Head::from_mesh(Mesh::sphere(Vec3::ZERO, 5.0, 4), 40).unwrap();
        let recipe = Recipe { strand_count: 8000, ..Recipe::fur() };
        let groom = grow(&recipe, &ball).unwrap();
        let mut octants = [0_i32; 8];
        for s in groom.strands() {
            let r = s[0];
            octants[usize::from(r.x > 0.0) + 2 * usize::from(r.y > 0.0) + 4 * usize::from(r.z > 0.0)] += 1;
        }
        // Stratified by area: an octant's share strays only where its border cuts strata, by far less than the
        // 30 of a random spread; 60 would be two of those.
        assert!(octants.iter().all(|n| (n - 1000).abs() < 60), "{octants:?}");
        assert_eq!(groom.metres_per_unit, None);
    }

    #[test]
    fn cells_find_the_same_neighbours_as_asking_everybody() {
        let places: Vec<Root> = (0..500_u32)
            .map(|i| {
                let normal = warp::uniform_sphere([hash::unit(i, 1), hash::unit(i, 2)]);
                Root { place: normal * 7.0, normal, side: if i % 3 == 0 { -1.0 } else { 1.0 } }
            })
            .collect();
        let seeds = Seeds::new(places.clone());
        for i in 0..300 {
            let p = warp::uniform_sphere([hash::unit(i, 3), hash::unit(i, 4)]) * 7.1;
            let side = [-1.0, 0.0, 1.0][i as usize % 3];
            let mut all: Vec<f32> =
                places.iter().filter(|r| r.side * side >= 0.0).map(|r| r.place.distance_squared(p)).collect();
            all.sort_by(f32::total_cmp);
            let found = seeds.nearest::<3>(p, side).map(|f| f.1);
            assert_eq!(found, [all[0], all[1], all[2]]);
        }
    }

    #[test]
    fn recipes_out_of_range_are_refused_by_name() {
        let refused = |recipe: Recipe| match grow(&recipe, &HEAD) {
            Err(GrowError::Value { name, .. }) => name,
            other => panic!("{:?}", other.map(|g| g.strand_count())),
        };
        let r = Recipe::wavy_long;
        assert_eq!(refused(Recipe { strand_count: 0, ..r() }), "strand_count");
        assert_eq!(refused(Recipe { points_per_strand: 1, ..r() }), "points_per_strand");
        assert_eq!(refused(Recipe { length: f32::NAN, ..r() }), "length");
        assert_eq!(refused(Recipe { gravity: f32::INFINITY, ..r() }), "gravity");
        assert_eq!(refused(Recipe { comb: Vec3::ZERO, ..r() }), "the length of comb");
        let huge = Recipe { strand_count: 1_000_000, points_per_strand: 200, ..r() };
        assert_eq!(grow(&huge, &HEAD), Err(GrowError::TooManyPoints { found: 200_000_000 }));
        let bald = Recipe { hairline_front: 100.0, hairline_nape: 100.0, ..r() };
        // The sideburns and ears have heights of their own, so only everything above them is bare.
        assert!(grow(&Recipe { strand_count: 10, ..bald }, &HEAD).is_ok());
        let nowhere = Head { scalp: Scalp::Above(50.0), ..HEAD.clone() };
        assert_eq!(grow(&small(r()), &nowhere), Err(GrowError::Bare));
    }
}
