//! How many rays a second, on one thread, meet the built-in scene? How long does it take to build, and how
//! large does it come out?

use std::hint::black_box;

use accel::{Accel, Basis, Options, Shape};
use bench::{builtin, primary_rays, secondary_rays, strands};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

const RAYS: u32 = 16_384;

fn rays(c: &mut Criterion) {
    let tracer = builtin();
    let kinds = [("primary", primary_rays(&tracer, RAYS)), ("secondary", secondary_rays(&tracer, RAYS))];
    for (name, rays) in &kinds {
        let hits = rays.iter().filter(|ray| tracer.accel().occluded(ray)).count();
        println!("{name} rays: {:.1} % hit something", 100.0 * hits as f64 / f64::from(RAYS));
    }
    let mut group = c.benchmark_group("accel/closest");
    group.throughput(Throughput::Elements(RAYS.into()));
    for (name, rays) in &kinds {
        group.bench_function(BenchmarkId::from_parameter(name), |b| {
            b.iter(|| {
                for ray in rays {
                    black_box(tracer.accel().closest(black_box(ray)));
                }
            });
        });
    }
    group.finish();
    let mut group = c.benchmark_group("accel/any");
    group.throughput(Throughput::Elements(RAYS.into()));
    for (name, rays) in &kinds {
        group.bench_function(BenchmarkId::from_parameter(name), |b| {
            b.iter(|| {
                for ray in rays {
                    black_box(tracer.accel().occluded(black_box(ray)));
                }
            });
        });
    }
    group.finish();
}

fn build(c: &mut Criterion) {
    let tracer = builtin();
    let set = strands(&tracer);
    let segments = set.points.len() - (set.offsets.len() - 1);
    let mut group = c.benchmark_group("accel/build");
    group.sample_size(10);
    group.throughput(Throughput::Elements(segments as u64));
    for (name, shape, basis) in [
        ("round_catmull_rom", Shape::Round, Basis::CatmullRom),
        ("round_linear", Shape::Round, Basis::Linear),
        ("ribbon_linear", Shape::Ribbon, Basis::Linear),
    ] {
        let options = Options { shape, basis, ..Options::default() };
        let stats = Accel::build(&[set], &[], &options).stats();
        println!(
            "{name}: {segments} segments in {} pieces, {:.1} bytes a segment, {:.1} MiB",
            stats.pieces,
            stats.bytes as f64 / segments as f64,
            stats.bytes as f64 / f64::from(1 << 20),
        );
        group.bench_function(BenchmarkId::from_parameter(name), |b| {
            b.iter(|| black_box(Accel::build(&[set], &[], &options)));
        });
    }
    group.finish();
}

criterion_group!(benches, rays, build);
criterion_main!(benches);
