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
    ("olc", 0xf4c87654de904dd7, 0x56234fb2c8707356),
    ("ppl", 0x1e1970c5753fd1e8, 0x9bf32ecf478ec42c),
    ("ppl+", 0xa8d2d6357f0d4e2b, 0x6830a65b1be3e962),
    ("ray", 0x7a231cee11731272, 0x476ab25474a6a8c6),
    ("ray-voxel", 0x1783515fa6a5685d, 0x1b9a2ebd8a6464f9),
    ("plane", 0xaae739a1166fa6c6, 0x50c7c3ca90019779),
    ("cp", 0x6120c0a7f84ce78d, 0x083ce6bec2caa280),
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
