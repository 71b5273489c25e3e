//! Random numbers as a pure function of (pixel, sample, dimension, seed).
//!
//! Every group of four dimensions is the first four of Sobol's sequence, Owen-scrambled and shuffled with
//! a seed of its own (Burley 2020): the four are stratified together, groups are independent of each
//! other. Within a sample the groups are: 0 the pixel (filter x, y; lens x, y), then three a vertex.

use math::hash;

/// The numbers of one sample of one pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sampler {
    seed: u32,
    index: u32,
}

/// Groups of four that a vertex uses.
const GROUPS: u32 = 3;

impl Sampler {
    pub(crate) fn new(x: u32, y: u32, index: u32, seed: u32) -> Self {
        // The sequence is 2^16 long; beyond that the next one starts.
        let pixel = hash::mix3(x, y, seed);
        let long = index >> 16;
        Self { seed: if long == 0 { pixel } else { hash::mix2(pixel, long) }, index: index & 0xffff }
    }

    #[inline]
    fn group(&self, group: u32) -> [f32; 4] {
        sobol_burley::sample_4d(self.index, 0, hash::mix2(self.seed, group))
    }

    /// Filter x, y and lens x, y.
    #[inline]
    pub(crate) fn pixel(&self) -> [f32; 4] {
        self.group(0)
    }

    /// The first four numbers of the scattered direction.
    #[inline]
    pub(crate) fn direction(&self, vertex: u32) -> [f32; 4] {
        self.group(1 + GROUPS * vertex)
    }

    /// Choice of light and position on it (two), and one spare.
    #[inline]
    pub(crate) fn light(&self, vertex: u32) -> [f32; 4] {
        self.group(2 + GROUPS * vertex)
    }

    /// The fifth number of the direction, Russian roulette, two spare.
    #[inline]
    pub(crate) fn rest(&self, vertex: u32) -> [f32; 4] {
        self.group(3 + GROUPS * vertex)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_stratified_over_samples_and_differ_between_pixels() {
        // 16 samples of one dimension fall into 16 different strata: Owen scrambling keeps the net.
        for group in 0..50 {
            let mut seen = [false; 16];
            for i in 0..16 {
                seen[(Sampler::new(3, 4, i, 9).group(group)[0] * 16.0) as usize] = true;
            }
            assert!(seen.iter().all(|&s| s), "group {group}");
        }
        assert_ne!(Sampler::new(3, 4, 0, 9).pixel(), Sampler::new(4, 3, 0, 9).pixel());
        assert_ne!(Sampler::new(3, 4, 0, 9).pixel(), Sampler::new(3, 4, 0, 8).pixel());
        assert_ne!(Sampler::new(3, 4, 0, 9).pixel(), Sampler::new(3, 4, 65_536, 9).pixel());
    }
}
