//! The reference renderer: an unbiased path tracer for hair
