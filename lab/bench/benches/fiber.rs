//! What does one evaluation, one density, both together, one sample of each model cost? Set-up for the shading
//! point is part of `prepare` alone.

use std::hint::black_box;

use bench::{direction_pairs, standard_fibers};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use fiber::{FiberSetup, Model, Scatter};
use math::hash;

const PAIRS: u32 = 512;

fn fibers(c: &mut Criterion) {
    let pairs = direction_pairs(PAIRS, 7);
    let models = standard_fibers();
    let prepared: Vec<(&str, Vec<FiberSetup>)> =
        models.iter().map(|(name, model)| (*name, pairs.iter().map(|(hit, _)| model.prepare(hit)).collect())).collect();
    let numbers: Vec<[f32; 5]> = (0..PAIRS).map(|i| std::array::from_fn(|d| hash::unit(i, 100 + d as u32))).collect();

    let mut group = c.benchmark_group("fiber/prepare");
    group.throughput(Throughput::Elements(PAIRS.into()));
    for (name, model) in &models {
        group.bench_function(BenchmarkId::from_parameter(name), |b| {
            b.iter(|| {
                for (hit, _) in &pairs {
                    black_box(model.prepare(black_box(hit)));
                }
            });
        });
    }
    group.finish();

    let mut group = c.benchmark_group("fiber/eval");
    group.throughput(Throughput::Elements(PAIRS.into()));
    for (name, setups) in &prepared {
        group.bench_function(BenchmarkId::from_parameter(name), |b| {
            b.iter(|| {
                for (setup, (_, s)) in setups.iter().zip(&pairs) {
                    black_box(setup.eval(black_box(*s)));
                }
            });
        });
    }
    group.finish();

    let mut group = c.benchmark_group("fiber/pdf");
    group.throughput(Throughput::Elements(PAIRS.into()));
    for (name, setups) in &prepared {
        group.bench_function(BenchmarkId::from_parameter(name), |b| {
            b.iter(|| {
                for (setup, (_, s)) in setups.iter().zip(&pairs) {
                    black_box(setup.pdf(black_box(*s)));
                }
            });
        });
    }
    group.finish();

    let mut group = c.benchmark_group("fiber/eval_pdf");
    group.throughput(Throughput::Elements(PAIRS.into()));
    for (name, setups) in &prepared {
        group.bench_function(BenchmarkId::from_parameter(name), |b| {
            b.iter(|| {
                for (setup, (_, s)) in setups.iter().zip(&pairs) {
                    black_box(setup.eval_pdf(black_box(*s)));
                }
            });
        });
    }
    group.finish();

    let mut group = c.benchmark_group("fiber/sample");
    group.throughput(Throughput::Elements(PAIRS.into()));
    for (name, setups) in &prepared {
        group.bench_function(BenchmarkId::from_parameter(name), |b| {
            b.iter(|| {
                for (setup, u) in setups.iter().zip(&numbers) {
                    black_box(setup.sample(black_box(*u)));
                }
            });
        });
    }
    group.finish();
}

criterion_group!(benches, fibers);
criterion_main!(benches);
