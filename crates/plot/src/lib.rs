//! Figures for papers and pages: charts as SVG and PNG, and what fibers scatter.
//!
//! - [`chart`] draws: axes, polar axes, heat maps, pictures, in a grid of panels. It knows nothing of hair.
//! - [`lobes`] measures a [`fiber::Fiber`] and makes figures of it.
//!
//! A figure is text before it is pixels: [`Figure::svg`](chart::Figure::svg) is the same string on every
//! machine, and [`Figure::png`](chart::Figure::png) draws that string with a font that is compiled in.
//!
//! ```
//! use plot::chart::{Axes, Axis, Figure, Panel, Series};
//!
//! let square = Series::line("area", (0..=20).map(|i| [f64::from(i), f64::from(i * i)]).collect());
//! let (x, y) = (Axis::new("side / mm"), Axis::new("area / mm^{2}"));
//! let axes = Axes { x, y, series: vec![square], ..Axes::default() };
//! let figure = Figure { title: "Squares".into(), panels: vec![Panel::new("", axes)], ..Figure::default() };
//! // The exponent is typeset, not printed.
//! assert!(figure.svg().contains("area / mm<tspan"));
//! ```

pub mod chart;
pub mod lobes;
