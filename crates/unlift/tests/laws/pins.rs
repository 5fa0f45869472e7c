//! Golden bytes: a change here changes every published figure. The numbers hold on every platform,
//! since only exact operations and a portable logarithm feed them. A change on purpose is blessed by
//! copying what the failing test prints, and shows in the diff.

use unlift::obfuscate::SCHEMES;
use unlift::recover::{Delta, RecoverOptions, Solver};

use crate::maps::*;

/// FNV-1a, 64 bits.
fn hash(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0xCBF2_9CE4_8422_2325, |h, &b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01B3))
}

/// (scheme, hash of the released map, hash of what consensus makes of it).
const PINS: &[(&str, u64, u64)] = &[
    ("olc", 0xbc5917367dfbbb82, 0x6917d1e102e4acee),
    ("ppl", 0x853f42e87f4d6ad1, 0xfeac798182fed30e),
    ("ppl+", 0xd1a39aa133219c2c, 0xf3e3972ab96d0300),
    ("ray", 0x8afdc7e564ab7e2f, 0xe831f85588e9368f),
    ("ray-voxel", 0x8b43b3092460bcbb, 0xa498afb74ba8420f),
    ("plane", 0xed46e9680801a7de, 0x071e9fc4935629e3),
    ("cp", 0x96a0f41fb6eaf080, 0x5e7a880602add49d),
];

#[test]
fn bytes_are_pinned() {
    let points = room::<3>(2026, 301);
    let mut found = Vec::new();
    for entry in SCHEMES {
        let Some(scheme) = entry.in_3d else { continue };
        let hidden = hide(scheme, &points, 0);
        let lists = hidden.lists(20, 0.5, 0);
        let options = RecoverOptions {
            solver: Solver::Consensus,
            delta: Delta::Fixed(0.1),
            seed: 0,
            ..RecoverOptions::default()
        };
        let recovered = solve(&hidden.released, &lists, options);
        let hashes = (hash(&released_bytes(&hidden.released)), hash(&recovered_bytes(&recovered)));
        found.push((entry.name, hashes.0, hashes.1));
    }
    let literal =
        |(name, a, b): &(&str, u64, u64)| format!("    (\"{name}\", {a:#018x}, {b:#018x}),");
    let printed: Vec<String> = found.iter().map(literal).collect();
    assert!(found == PINS, "the bytes are now\n{}", printed.join("\n"));
}
