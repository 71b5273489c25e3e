//! The groom itself: points, where each strand begins, and widths.

use std::fmt;
use std::ops::Range;

use math::{Affine3A, Mat3, Vec3};

use crate::Attributes;

/// Strands as data, root to tip.
///
/// A strand is a run of at least two finite points. Widths, colours and the rest are optional. The unit of
/// length is the groom's own; [`metres_per_unit`](Self::metres_per_unit) names it where it is known.
#[derive(Clone, Debug, PartialEq)]
pub struct Groom {
    points: Vec<Vec3>,
    /// Strand `s` owns `points[offsets[s]..offsets[s + 1]]`.
    offsets: Vec<u32>,
    /// Fiber radius per point, in the unit of the points, `>= 0`; `None` when the source has no widths.
    /// [`set_radius`](Self::set_radius) checks what it stores.
    pub radius: Option<Vec<f32>>,
    /// Everything else that is known per groom, strand or point.
    pub attributes: Attributes,
    /// Which axis points up.
    pub up: UpAxis,
    /// Length of one unit in metres, where it is known: 0.01 for centimetres.
    pub metres_per_unit: Option<f32>,
}

/// Why strands could not be made into a groom.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum GroomError {
    /// A strand has fewer than two points.
    TooShort {
        /// The strand, from 0.
        strand: usize,
        /// How many points it has.
        points: u32,
    },
    /// The counts do not add up to the points.
    Counts {
        /// Sum of the points per strand.
        declared: u64,
        /// How many points there are.
        found: usize,
    },
    /// More points than 32 bits can number.
    TooManyPoints {
        /// How many points there are.
        found: usize,
    },
    /// A coordinate is infinite or not a number.
    NotFinite {
        /// The strand, from 0.
        strand: usize,
        /// The point within the strand, from 0 at the root.
        point: usize,
    },
    /// Widths and points differ in number.
    RadiusCount {
        /// How many widths came.
        found: usize,
        /// How many points there are.
        expected: usize,
    },
    /// A width is negative, infinite or not a number.
    Radius {
        /// The strand, from 0.
        strand: usize,
        /// The point within the strand, from 0 at the root.
        point: usize,
        /// The radius that came.
        found: f32,
    },
}

impl fmt::Display for GroomError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooShort { strand, points } => {
                write!(f, "strand {strand} has {points} points; a strand needs at least 2")
            }
            Self::Counts { declared, found } => {
                write!(f, "the strands need {declared} points, but there are {found}")
            }
            Self::TooManyPoints { found } => {
                write!(f, "{found} points are more than a groom can hold ({})", u32::MAX)
            }
            Self::NotFinite { strand, point } => {
                write!(f, "point {point} of strand {strand} is not finite")
            }
            Self::RadiusCount { found, expected } => {
                write!(f, "there are {found} radii for {expected} points")
            }
            Self::Radius { strand, point, found } => {
                write!(f, "radius {found} at point {point} of strand {strand}; it must be finite and >= 0")
            }
        }
    }
}

impl std::error::Error for GroomError {}

impl Groom {
    /// Strands from all their points, root to tip and strand after strand, and the number of points of each.
    ///
    /// The groom has no widths and no attributes yet, and y is up.
    ///
    /// # Errors
    /// When a strand has fewer than 2 points, the counts do not add up to `points`, there are more than
    /// `u32::MAX` points, or a coordinate is not finite.
    pub fn new(points: Vec<Vec3>, counts: impl IntoIterator<Item = u32>) -> Result<Self, GroomError> {
        if u32::try_from(points.len()).is_err() {
            return Err(GroomError::TooManyPoints { found: points.len() });
        }
        let mut offsets = vec![0_u32];
        let mut end = 0_u64;
        for (strand, count) in counts.into_iter().enumerate() {
            if count < 2 {
                return Err(GroomError::TooShort { strand, points: count });
            }
            end += u64::from(count);
            // Past the last point the sum is wrong anyway; saturating keeps it reportable.
            offsets.push(u32::try_from(end).unwrap_or(u32::MAX));
        }
        if end != points.len() as u64 {
            return Err(GroomError::Counts { declared: end, found: points.len() });
        }
        if let Some(i) = points.iter().position(|p| !p.is_finite()) {
            let (strand, point) = locate(&offsets, i);
            return Err(GroomError::NotFinite { strand, point });
        }
        let attributes = Attributes::new(offsets.len() - 1, points.len());
        Ok(Self { points, offsets, radius: None, attributes, up: UpAxis::Y, metres_per_unit: None })
    }

    /// How many strands there are.
    #[inline]
    pub fn strand_count(&self) -> usize {
        self.offsets.len() - 1
    }

    /// How many points all strands have together.
    #[inline]
    pub fn point_count(&self) -> usize {
        self.points.len()
    }

    /// All points, strand after strand.
    #[inline]
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// Where each strand begins among the points, with the total at the end.
    #[inline]
    pub fn offsets(&self) -> &[u32] {
        &self.offsets
    }

    /// The points of strand `strand`, root first.
    ///
    /// # Panics
    /// When there is no such strand, as with any slice.
    #[inline]
    pub fn strand(&self, strand: usize) -> &[Vec3] {
        &self.points[self.point_range(strand)]
    }

    /// Where the points of strand `strand` are among all points.
    ///
    /// # Panics
    /// When there is no such strand, as with any slice.
    #[inline]
    pub fn point_range(&self, strand: usize) -> Range<usize> {
        self.offsets[strand] as usize..self.offsets[strand + 1] as usize
    }

    /// All strands in order.
    pub fn strands(&self) -> impl ExactSizeIterator<Item = &[Vec3]> {
        (0..self.strand_count()).map(|s| self.strand(s))
    }

    /// How far along its strand a point is, by index: 0 at the root, 1 at the tip. `point` counts all points.
    pub fn u_of_point(&self, strand: usize, point: usize) -> f32 {
        let range = self.point_range(strand);
        (point.saturating_sub(range.start)) as f32 / (range.len() - 1) as f32
    }

    /// Length of a strand's polyline.
    pub fn strand_length(&self, strand: usize) -> f32 {
        polyline_length(self.strand(strand))
    }

    /// Smallest box around all points as `(least, greatest)`; `None` without points. Widths are not counted.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let &first = self.points.first()?;
        Some(self.points.iter().fold((first, first), |(lo, hi), &p| (lo.min(p), hi.max(p))))
    }

    /// Stores the radius of every point.
    ///
    /// # Errors
    /// When their number differs from the points', or one is negative or not finite.
    pub fn set_radius(&mut self, radius: Vec<f32>) -> Result<(), GroomError> {
        if radius.len() != self.points.len() {
            return Err(GroomError::RadiusCount { found: radius.len(), expected: self.points.len() });
        }
        if let Some(i) = radius.iter().position(|r| !(r.is_finite() && *r >= 0.0)) {
            let (strand, point) = locate(&self.offsets, i);
            return Err(GroomError::Radius { strand, point, found: radius[i] });
        }
        self.radius = Some(radius);
        Ok(())
    }

    /// Stores radii that depend on the place along the strand alone: `profile(u)` for `u` from 0 at the root
    /// to 1 at the tip.
    ///
    /// # Errors
    /// When the profile gives a negative value or one that is not finite.
    pub fn set_radius_profile(&mut self, profile: impl Fn(f32) -> f32) -> Result<(), GroomError> {
        let mut radius = Vec::with_capacity(self.points.len());
        for strand in 0..self.strand_count() {
            radius.extend(self.point_range(strand).map(|p| profile(self.u_of_point(strand, p))));
        }
        self.set_radius(radius)
    }

    /// Moves all points; radii scale by the cube root of the change of volume. Attributes, the up axis and
    /// the unit stay as they are.
    ///
    /// The transform must be finite and small enough to leave the points finite.
    pub fn transform(&mut self, by: Affine3A) {
        for p in &mut self.points {
            *p = by.transform_point3(*p);
        }
        let scale = by.matrix3.determinant().abs().cbrt();
        for r in self.radius.iter_mut().flatten() {
            *r *= scale;
        }
        debug_assert!(self.points.iter().all(|p| p.is_finite()), "a transform made points infinite");
    }

    /// Turns the groom so that y is up.
    pub fn make_y_up(&mut self) {
        if self.up != UpAxis::Y {
            self.transform(self.up.to_y_up());
            self.up = UpAxis::Y;
        }
    }

    /// Keeps the strands for which `keep` says yes; returns how many went.
    pub fn retain_strands(&mut self, mut keep: impl FnMut(usize) -> bool) -> usize {
        let before = self.strand_count();
        let strands: Vec<u32> = (0..before as u32).filter(|&s| keep(s as usize)).collect();
        if strands.len() == before {
            return 0;
        }
        let mut points = Vec::new();
        let mut counts = Vec::with_capacity(strands.len());
        for &s in &strands {
            let (start, end) = (self.offsets[s as usize], self.offsets[s as usize + 1]);
            points.extend(start..end);
            counts.push(end - start);
        }
        self.select(&strands, &points, &counts);
        before - self.strand_count()
    }

    /// Keeps these strands and, of them, these points; `counts` says how many of the points each strand has,
    /// at least 2.
    pub(crate) fn select(&mut self, strands: &[u32], points: &[u32], counts: &[u32]) {
        self.attributes = self.attributes.select(strands, points);
        self.points = points.iter().map(|&i| self.points[i as usize]).collect();
        if let Some(radius) = &mut self.radius {
            *radius = points.iter().map(|&i| radius[i as usize]).collect();
        }
        let mut end = 0;
        self.offsets = std::iter::once(0)
            .chain(counts.iter().map(|n| {
                end += n;
                end
            }))
            .collect();
    }
}

/// Length of a polyline.
pub(crate) fn polyline_length(points: &[Vec3]) -> f32 {
    points.windows(2).map(|w| w[0].distance(w[1])).sum()
}

/// Strand and point within it of point `i` of all.
fn locate(offsets: &[u32], i: usize) -> (usize, usize) {
    let strand = offsets.partition_point(|&o| o as usize <= i).saturating_sub(1);
    (strand, i - offsets[strand] as usize)
}

/// Which axis of a file points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// x is up.
    X,
    /// y is up; Cuticle's own convention.
    #[default]
    Y,
    /// z is up.
    Z,
}

impl UpAxis {
    /// The rotation that makes y the up axis: for z up it is `(x, y, z) -> (x, z, -y)`, for x up
    /// `(x, y, z) -> (-y, x, z)`.
    pub fn to_y_up(self) -> Affine3A {
        let columns = match self {
            Self::X => [Vec3::Y, Vec3::NEG_X, Vec3::Z],
            Self::Y => return Affine3A::IDENTITY,
            Self::Z => [Vec3::X, Vec3::NEG_Z, Vec3::Y],
        };
        Affine3A::from_mat3(Mat3::from_cols(columns[0], columns[1], columns[2]))
    }
}

impl fmt::Display for UpAxis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        })
    }
}

/// The axis that is probably up, since hair falls: the one along which tips lie below their roots the most.
///
/// `None` when the strands point every way (short fur), rise instead of falling, or fall between two axes.
pub fn guess_up(groom: &Groom) -> Option<UpAxis> {
    let (mut fall, mut reach) = (Vec3::ZERO, 0.0_f64);
    let mut sum = [0.0_f64; 3];
    for strand in groom.strands() {
        if let (Some(&root), Some(&tip)) = (strand.first(), strand.last()) {
            let chord = tip - root;
            reach += f64::from(chord.length());
            for (s, c) in sum.iter_mut().zip(chord.to_array()) {
                *s += f64::from(c);
            }
        }
    }
    if reach > 0.0 {
        fall = -Vec3::from_array(sum.map(|s| (s / reach) as f32));
    }
    let axes = [(fall.x, UpAxis::X), (fall.y, UpAxis::Y), (fall.z, UpAxis::Z)];
    let best = axes.into_iter().max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))?;
    let rivals = axes.into_iter().filter(|a| a.1 != best.1).map(|a| a.0.abs()).fold(0.0, f32::max);
    // A fifth of the reach is well above what combing to one side leaves in fur that stands off.
    (best.0 > 0.2 && rivals < 0.8 * best.0).then_some(best.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Attribute;

    /// Two strands, of 3 and 2 points, that fall along -z.
    fn two() -> Groom {
        let points = vec![
            Vec3::new(0.0, 0.0, 0.0),
            Vec3::new(0.0, 0.0, -1.0),
            Vec3::new(0.0, 0.0, -3.0),
            Vec3::new(1.0, 0.0, 0.0),
            Vec3::new(1.0, 0.5, -2.0),
        ];
        Groom::new(points, [3, 2]).unwrap()
    }

    #[test]
    fn construction_is_checked() {
        let g = two();
        assert_eq!((g.strand_count(), g.point_count()), (2, 5));
        assert_eq!(g.strand(1), &g.points()[3..5]);
        assert_eq!(g.strand_length(0), 3.0);
        assert_eq!(g.u_of_point(0, 1), 0.5);
        assert_eq!(g.bounds(), Some((Vec3::new(0.0, 0.0, -3.0), Vec3::new(1.0, 0.5, 0.0))));

        let p = |n| vec![Vec3::ZERO; n];
        assert_eq!(Groom::new(p(3), [2, 1]), Err(GroomError::TooShort { strand: 1, points: 1 }));
        assert_eq!(Groom::new(p(3), [2]), Err(GroomError::Counts { declared: 2, found: 3 }));
        assert_eq!(Groom::new(p(3), [2, 2]), Err(GroomError::Counts { declared: 4, found: 3 }));
        let mut bad = p(5);
        bad[3].y = f32::NAN;
        assert_eq!(Groom::new(bad, [2, 3]), Err(GroomError::NotFinite { strand: 1, point: 1 }));
        assert_eq!(Groom::new(Vec::new(), []).map(|g| g.bounds()), Ok(None));
    }

    #[test]
    fn radii_are_checked() {
        let mut g = two();
        assert_eq!(g.set_radius(vec![0.1; 4]), Err(GroomError::RadiusCount { found: 4, expected: 5 }));
        assert_eq!(
            g.set_radius(vec![0.1, 0.1, 0.1, -0.5, 0.1]),
            Err(GroomError::Radius { strand: 1, point: 0, found: -0.5 })
        );
        assert_eq!(g.set_radius_profile(|u| 2.0 - u), Ok(()));
        assert_eq!(g.radius, Some(vec![2.0, 1.5, 1.0, 2.0, 1.0]));
    }

    #[test]
    fn scaling_scales_widths_and_turning_does_not() {
        let mut g = two();
        g.set_radius(vec![0.5; 5]).unwrap();
        g.transform(Affine3A::from_scale(Vec3::splat(2.0)));
        assert_eq!(g.strand_length(0), 6.0);
        // The cube root of 8 is exact to an ulp.
        assert!((g.radius.as_ref().unwrap()[0] - 1.0).abs() < 1e-6);
        g.up = UpAxis::Z;
        g.make_y_up();
        assert_eq!(g.up, UpAxis::Y);
        assert!((g.strand(0)[2] - Vec3::new(0.0, -6.0, 0.0)).length() < 1e-6);
        assert!((g.radius.as_ref().unwrap()[0] - 1.0).abs() < 1e-6);
    }

    #[test]
    fn up_axes_turn_as_documented() {
        let p = Vec3::new(1.0, 2.0, 3.0);
        assert_eq!(UpAxis::Z.to_y_up().transform_point3(p), Vec3::new(1.0, 3.0, -2.0));
        assert_eq!(UpAxis::X.to_y_up().transform_point3(p), Vec3::new(-2.0, 1.0, 3.0));
        for up in [UpAxis::X, UpAxis::Y, UpAxis::Z] {
            assert!((up.to_y_up().matrix3.determinant() - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn falling_hair_tells_which_way_is_up() {
        let mut g = two();
        assert_eq!(guess_up(&g), Some(UpAxis::Z));
        g.transform(Affine3A::from_rotation_y(std::f32::consts::PI));
        assert_eq!(guess_up(&g), None, "hair that rises says nothing");
        let star = vec![Vec3::ZERO, Vec3::X, Vec3::ZERO, Vec3::NEG_X];
        assert_eq!(guess_up(&Groom::new(star, [2, 2]).unwrap()), None);
    }

    #[test]
    fn attributes_follow_the_strands_that_stay() {
        let mut g = two();
        g.set_radius(vec![1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        g.attributes.insert("id", Attribute::strand_floats(vec![10.0, 20.0])).unwrap();
        g.attributes.insert("w", Attribute::point_floats(vec![1.0, 2.0, 3.0, 4.0, 5.0])).unwrap();
        assert_eq!(g.retain_strands(|s| s == 1), 1);
        assert_eq!((g.strand_count(), g.point_count()), (1, 2));
        assert_eq!(g.radius, Some(vec![4.0, 5.0]));
        assert_eq!(g.attributes.float("id", 0, 0, 0.0), Some(20.0));
        assert_eq!(g.attributes.float("w", 0, 0, 0.5), Some(4.5));
        assert!(g.attributes.insert("v", Attribute::point_floats(vec![0.0; 2])).is_ok());
    }
}
