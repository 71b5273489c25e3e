//! Looks in memory: parameters that vary over strands, and the fiber they make at a point.
//!
//! `varying` is a parameter, `shader` a model made of them, `build` makes shaders from the section of a file.

mod build;
mod shader;
mod varying;

use fiber::{Fiber, GroomFiber};
use groom::Attributes;

use crate::error::SceneError;
use crate::file::LookSection;
use crate::source::Source;
use build::Builder;
use shader::Shader;

/// A point on a strand, as far as a look cares.
#[derive(Clone, Copy, Debug)]
pub struct StrandPoint<'g> {
    /// The strand within its groom, from 0.
    pub strand: u32,
    /// Parameter along the strand: 0 at the root, 1 at the tip.
    pub u: f32,
    /// The point before the place, counted through all points of the groom.
    pub point_index: usize,
    /// How far the place is from that point to the next one, in `[0, 1]`.
    pub frac: f32,
    /// The attributes of the groom.
    pub attributes: &'g Attributes,
    /// Sets the random numbers of one groom apart from those of another.
    pub seed: u32,
}

/// What fibers are made of: gives the fiber model with all its parameters at any point of a strand.
#[derive(Clone, Debug)]
pub struct Look {
    name: String,
    shader: Shader,
    constant: Option<(Fiber, GroomFiber)>,
    attributes: Vec<String>,
}

impl Look {
    /// The name by which grooms call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The fiber at a point of a strand. Allocates nothing; every parameter is within its legal range.
    #[inline]
    pub fn fiber(&self, at: &StrandPoint<'_>) -> Fiber {
        match self.constant {
            Some((fiber, _)) => fiber,
            None => self.shader.fiber(Some(at)),
        }
    }

    /// The fiber that this look gives everywhere; `None` when a parameter varies.
    #[inline]
    pub fn constant(&self) -> Option<Fiber> {
        self.constant.map(|(fiber, _)| fiber)
    }

    /// That fiber, ready for many shading points.
    #[inline]
    pub fn for_groom(&self) -> Option<&GroomFiber> {
        self.constant.as_ref().map(|(_, groom)| groom)
    }

    /// The fiber without any variation: ramps at the root, no random offsets, no attributes.
    pub fn base(&self) -> Fiber {
        self.shader.fiber(None)
    }

    /// The attributes of the groom that the look reads, where the groom has them.
    pub fn attributes(&self) -> &[String] {
        &self.attributes
    }
}

/// A look from its section of the file, and what is odd about it.
pub(crate) fn resolve(
    name: &str,
    section: &LookSection,
    source: &Source<'_>,
) -> Result<(Look, Vec<String>), SceneError> {
    let mut builder =
        Builder { source, look: format!("look.{name}"), attributes: Vec::new(), varies: false, warnings: Vec::new() };
    let mut shader = builder.shader(section)?;
    builder.invert_colour(&mut shader, section)?;
    let constant = (!builder.varies).then(|| {
        let fiber = shader.fiber(None);
        (fiber, fiber.for_groom())
    });
    let look = Look { name: name.to_owned(), shader, constant, attributes: builder.attributes };
    Ok((look, builder.warnings))
}
