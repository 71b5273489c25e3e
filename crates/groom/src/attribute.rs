//! Named values that ride along with a groom: per groom, per strand or per point.

use std::collections::BTreeMap;
use std::fmt;

/// What one value of an attribute belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Domain {
    /// One value for everything.
    Groom,
    /// One value per strand.
    Strand,
    /// One value per point, in the order of the groom's points.
    Point,
}

/// The numbers of an attribute.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// One number each.
    Float(Vec<f32>),
    /// Three numbers each: a colour (linear sRGB) or a vector.
    Vec3(Vec<[f32; 3]>),
}

impl Values {
    /// How many values there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Float(v) => v.len(),
            Self::Vec3(v) => v.len(),
        }
    }

    /// Whether there is no value at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Index of the first value that is infinite or not a number.
    fn first_not_finite(&self) -> Option<usize> {
        match self {
            Self::Float(v) => v.iter().position(|x| !x.is_finite()),
            Self::Vec3(v) => v.iter().position(|x| !x.iter().all(|c| c.is_finite())),
        }
    }

    /// The values at `kept`, in that order.
    fn select(&self, kept: &[u32]) -> Self {
        match self {
            Self::Float(v) => Self::Float(kept.iter().map(|&i| v[i as usize]).collect()),
            Self::Vec3(v) => Self::Vec3(kept.iter().map(|&i| v[i as usize]).collect()),
        }
    }
}

/// Values and what they belong to.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    /// What one value belongs to.
    pub domain: Domain,
    /// The numbers.
    pub values: Values,
}

impl Attribute {
    /// One number per point.
    pub fn point_floats(values: Vec<f32>) -> Self {
        Self { domain: Domain::Point, values: Values::Float(values) }
    }

    /// One number per strand.
    pub fn strand_floats(values: Vec<f32>) -> Self {
        Self { domain: Domain::Strand, values: Values::Float(values) }
    }

    /// Three numbers per point.
    pub fn point_vectors(values: Vec<[f32; 3]>) -> Self {
        Self { domain: Domain::Point, values: Values::Vec3(values) }
    }

    /// Three numbers per strand.
    pub fn strand_vectors(values: Vec<[f32; 3]>) -> Self {
        Self { domain: Domain::Strand, values: Values::Vec3(values) }
    }

    /// The number on strand `strand`, `frac` in `[0, 1]` of the way from point `point` to the next one of the
    /// same strand; `point` counts all points of the groom. `None` for vectors and for indices out of range.
    #[inline]
    pub fn float_at(&self, strand: usize, point: usize, frac: f32) -> Option<f32> {
        let Values::Float(values) = &self.values else {
            return None;
        };
        match self.domain {
            Domain::Groom => values.first().copied(),
            Domain::Strand => values.get(strand).copied(),
            Domain::Point => {
                let a = *values.get(point)?;
                let b = values.get(point + 1).copied().unwrap_or(a);
                Some(math::lerp(a, b, frac))
            }
        }
    }

    /// The vector at a place, as in [`float_at`](Self::float_at).
    #[inline]
    pub fn vec3_at(&self, strand: usize, point: usize, frac: f32) -> Option<[f32; 3]> {
        let Values::Vec3(values) = &self.values else {
            return None;
        };
        match self.domain {
            Domain::Groom => values.first().copied(),
            Domain::Strand => values.get(strand).copied(),
            Domain::Point => {
                let a = *values.get(point)?;
                let b = values.get(point + 1).copied().unwrap_or(a);
                Some([0, 1, 2].map(|k| math::lerp(a[k], b[k], frac)))
            }
        }
    }
}

/// Why an attribute was not accepted.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum AttributeError {
    /// The name is empty.
    Name,
    /// The number of values does not fit the domain.
    Length {
        /// The attribute.
        name: String,
        /// What its values belong to.
        domain: Domain,
        /// How many values came.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// A value is infinite or not a number.
    NotFinite {
        /// The attribute.
        name: String,
        /// Which of its values.
        index: usize,
    },
}

impl fmt::Display for AttributeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name => write!(f, "an attribute needs a name"),
            Self::Length { name, domain, found, expected } => {
                let what = match domain {
                    Domain::Groom => "groom",
                    Domain::Strand => "strand",
                    Domain::Point => "point",
                };
                write!(f, "attribute {name:?} has {found} values; one per {what} makes {expected}")
            }
            Self::NotFinite { name, index } => {
                write!(f, "value {index} of attribute {name:?} is not a finite number")
            }
        }
    }
}

impl std::error::Error for AttributeError {}

/// The attributes of one groom, by name.
///
/// `color` (vectors per point, linear sRGB) and `transparency` (numbers per point) are the names that the
/// readers use; a groom may carry any others.
#[derive(Clone, Debug, PartialEq)]
pub struct Attributes {
    strand_count: usize,
    point_count: usize,
    by_name: BTreeMap<String, Attribute>,
}

impl Attributes {
    /// None yet, for a groom of this size.
    pub(crate) fn new(strand_count: usize, point_count: usize) -> Self {
        Self { strand_count, point_count, by_name: BTreeMap::new() }
    }

    /// Adds or replaces an attribute.
    ///
    /// # Errors
    /// When the name is empty, the number of values does not match the domain, or one is not finite.
    pub fn insert(&mut self, name: impl Into<String>, attribute: Attribute) -> Result<(), AttributeError> {
        let name = name.into();
        if name.is_empty() {
            return Err(AttributeError::Name);
        }
        let expected = match attribute.domain {
            Domain::Groom => 1,
            Domain::Strand => self.strand_count,
            Domain::Point => self.point_count,
        };
        let found = attribute.values.len();
        if found != expected {
            return Err(AttributeError::Length { name, domain: attribute.domain, found, expected });
        }
        if let Some(index) = attribute.values.first_not_finite() {
            return Err(AttributeError::NotFinite { name, index });
        }
        self.by_name.insert(name, attribute);
        Ok(())
    }

    /// Removes an attribute and returns it.
    pub fn remove(&mut self, name: &str) -> Option<Attribute> {
        self.by_name.remove(name)
    }

    /// The attribute of that name.
    pub fn get(&self, name: &str) -> Option<&Attribute> {
        self.by_name.get(name)
    }

    /// All attributes, by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Attribute)> {
        self.by_name.iter().map(|(name, attribute)| (name.as_str(), attribute))
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.by_name.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.by_name.is_empty()
    }

    /// Looks a number up by name; see [`Attribute::float_at`].
    pub fn float(&self, name: &str, strand: usize, point: usize, frac: f32) -> Option<f32> {
        self.get(name)?.float_at(strand, point, frac)
    }

    /// Looks a vector up by name; see [`Attribute::vec3_at`].
    pub fn vec3(&self, name: &str, strand: usize, point: usize, frac: f32) -> Option<[f32; 3]> {
        self.get(name)?.vec3_at(strand, point, frac)
    }

    /// The attributes of a groom that keeps only these strands and points.
    pub(crate) fn select(&self, strands: &[u32], points: &[u32]) -> Self {
        let by_name = self
            .by_name
            .iter()
            .map(|(name, attribute)| {
                let values = match attribute.domain {
                    Domain::Groom => attribute.values.clone(),
                    Domain::Strand => attribute.values.select(strands),
                    Domain::Point => attribute.values.select(points),
                };
                (name.clone(), Attribute { domain: attribute.domain, values })
            })
            .collect();
        Self { strand_count: strands.len(), point_count: points.len(), by_name }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_checked_against_the_domain() {
        let mut attributes = Attributes::new(2, 5);
        assert!(attributes.insert("a", Attribute::strand_floats(vec![1.0, 2.0])).is_ok());
        assert!(attributes.insert("b", Attribute::point_vectors(vec![[0.0; 3]; 5])).is_ok());
        assert_eq!(
            attributes.insert("c", Attribute::point_floats(vec![0.0; 4])),
            Err(AttributeError::Length { name: "c".into(), domain: Domain::Point, found: 4, expected: 5 })
        );
        assert_eq!(
            attributes.insert("d", Attribute::strand_floats(vec![0.0, f32::NAN])),
            Err(AttributeError::NotFinite { name: "d".into(), index: 1 })
        );
        assert_eq!(attributes.insert("", Attribute::strand_floats(vec![0.0; 2])), Err(AttributeError::Name));
        assert_eq!(attributes.len(), 2);
    }

    #[test]
    fn point_values_interpolate_and_strand_values_do_not() {
        let mut attributes = Attributes::new(2, 5);
        let per_point = Attribute::point_floats(vec![0.0, 1.0, 4.0, 8.0, 9.0]);
        attributes.insert("width", per_point).unwrap();
        attributes.insert("random", Attribute::strand_floats(vec![0.25, 0.75])).unwrap();
        assert_eq!(attributes.float("width", 0, 1, 0.5), Some(2.5));
        assert_eq!(attributes.float("random", 1, 3, 0.5), Some(0.75));
        assert_eq!(attributes.vec3("width", 0, 1, 0.5), None);
        assert_eq!(attributes.float("absent", 0, 0, 0.0), None);
        assert_eq!(attributes.float("width", 0, 9, 0.0), None);
    }
}
