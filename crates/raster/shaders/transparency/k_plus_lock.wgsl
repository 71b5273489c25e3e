// The nearest fragments of each pixel behind a semaphore. Keys as in `k_plus.wgsl`, without the highest bit.
// `k_plus_insert` is written out by `k_plus.rs`.

const K_PLUS_NEAREST: u32 = 0x7fffffffu;
// How often a fragment asks for the semaphore. It gives up then, because a device that runs neighbours in step may
// never let the holder go on.
const K_PLUS_TRIES: u32 = 4096u;

@group(3) @binding(0) var<uniform> k_plus_band: ChainBand;
// K_PLUS_LENGTH keys a pixel; the first one is the farthest. All is atomic so that no cache stands between one
// holder of the semaphore and the next.
@group(3) @binding(1) var<storage, read_write> k_plus_slots: array<atomic<u32>>;
@group(3) @binding(2) var<storage, read_write> k_plus_payloads: array<atomic<u32>>;
// How many fragments gave up, then the semaphores: 0 is free.
@group(3) @binding(3) var<storage, read_write> k_plus_locks: array<atomic<u32>>;

fn k_plus_put(at: u32, key: u32, payload: vec2u) {
    atomicStore(&k_plus_payloads[2u * at], payload.x);
    atomicStore(&k_plus_payloads[2u * at + 1u], payload.y);
    atomicStore(&k_plus_slots[at], key);
}

fn k_plus_move(to: u32, source: u32) {
    let payload = vec2u(atomicLoad(&k_plus_payloads[2u * source]), atomicLoad(&k_plus_payloads[2u * source + 1u]));
    k_plus_put(to, atomicLoad(&k_plus_slots[source]), payload);
}

// Key of a node of the heap; nodes that do not exist are nearer than any.
fn k_plus_node(base: u32, node: u32) -> u32 {
    if node < K_PLUS_LENGTH {
        return atomicLoad(&k_plus_slots[base + node]);
    }
    return 0xffffffffu;
}

@fragment
fn k_plus_fill(v: HairVertex) -> @location(0) vec4f {
    let f = hair_fragment(v);
    if !view_hidden(v.clip) && f.alpha >= CHAIN_LEAST_ALPHA {
        let pixel = chain_pixel(k_plus_band, v.clip.xy);
        let base = pixel * K_PLUS_LENGTH;
        let key = K_PLUS_NEAREST - chain_bits(f.depth);
        // The farthest only ever comes nearer, and is written once by each holder: no semaphore to read it.
        if key > atomicLoad(&k_plus_slots[base]) {
            let payload = fragment_payload(f);
            var tries = 0u;
            var done = false;
            loop {
                if done || tries >= K_PLUS_TRIES {
                    break;
                }
                if atomicExchange(&k_plus_locks[1u + pixel], 1u) == 0u {
                    k_plus_insert(base, key, payload);
                    atomicStore(&k_plus_locks[1u + pixel], 0u);
                    done = true;
                }
                tries += 1u;
            }
            if !done {
                atomicAdd(&k_plus_locks[0], 1u);
            }
        }
    }
    return vec4f(0.0);
}
