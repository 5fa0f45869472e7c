//! Golden bytes: a change here changes every published figure. They hold on every platform, because
//! only exact operations and a portable logarithm are used. After an intended change, copy the output of the failing test.

use unlift::obfuscate::SCHEMES;

use crate::maps::*;

/// Hashes `bytes` with 64-bit FNV-1a.
fn hash(bytes: &[u8]) -> u64 {
    let step = |h: u64, byte: &u8| (h ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01B3);
    bytes.iter().fold(0xCBF2_9CE4_8422_2325, step)
}

/// Asserts the bytes, and prints what they are now.
fn same<T: PartialEq + std::fmt::Debug>(found: &[T], pinned: &[T]) {
    let rows: Vec<String> = found.iter().map(|row| format!("    {row:#x?},")).collect();
    assert!(found == pinned, "the bytes are now (format the file)\n{}", rows.join("\n"));
}

/// (Scheme, hash of the fingerprint of the released map, hash of its recovery by consensus).
const PINS: &[(&str, u64, u64)] = &[
    ("olc", 0x74608c29f325643f, 0x56234fb2c8707356),
    ("ppl", 0xb6b465b8e6afe691, 0x9bf32ecf478ec42c),
    ("ppl+", 0xb16ee7fbbac33e1f, 0x6830a65b1be3e962),
    ("ray", 0x1fa61b5ffdc00cac, 0x476ab25474a6a8c6),
    ("ray-voxel", 0x4e77dd73066210bc, 0x1b9a2ebd8a6464f9),
    ("plane", 0x45116a600078fd0f, 0x50c7c3ca90019779),
    ("cp", 0x96ff0f8d6ead9584, 0x59ac9f8fbd60e6fa),
];

#[test]
fn bytes_are_pinned() {
    let points = room::<3>(2026, 301);
    let of = |entry: &Entry| {
        let hidden = hide(entry, &points, 0);
        let delta = Delta::Fixed(0.1);
        let options = RecoverOptions { delta, seed: 0, ..RecoverOptions::default() };
        let lists = hidden.lists(20, 0.5, 0);
        let recovered = solve(&hidden.released, &lists, (Builtin::Consensus, options));
        (entry.name, hash(&hidden.released.fingerprint().0), hash(&recovered_bytes(&recovered)))
    };
    let in_3d = SCHEMES.iter().filter(|entry| entry.dimensions() == 3);
    same(&in_3d.map(of).collect::<Vec<_>>(), PINS);
}

/// (Scheme, dimension, hash of joint recovery with automatic options).
const JOINT: &[(&str, usize, u64)] = &[
    ("olc", 3, 0x07b5193cf50df1f2),
    ("ppl", 3, 0xfface7724d45680c),
    ("ppl+", 3, 0xa77859730fc16b32),
    ("ray", 3, 0x98a07ee0f5289e93),
    ("ray-voxel", 3, 0x56cb97bf6a79f352),
    ("plane", 3, 0xd381c4d257c3ca14),
    ("cp", 3, 0x9a373fc235e094c4),
    ("lines2d", 2, 0xd410acbf7072f145),
    ("cp2d", 2, 0xc5ed080c1285e189),
    ("dcl2d", 2, 0x8068383fa063d5d4),
];

/// Joint recovery with automatic delta covers nearly all of `recover`.
#[test]
fn bytes_of_joint_recovery_are_pinned() {
    fn of<const D: usize>(entry: &Entry) -> (&'static str, usize, u64) {
        let hidden = hide::<D>(entry, &room(2027, 500), 0);
        let recovered = solve(&hidden.released, &hidden.lists(20, 0.5, 0), joint());
        (entry.name, D, hash(&recovered_bytes(&recovered)))
    }
    let all = |entry: &Entry| if entry.dimensions() == 2 { of::<2>(entry) } else { of::<3>(entry) };
    same(&SCHEMES.iter().map(all).collect::<Vec<_>>(), JOINT);
}

/// (Scheme, hash of the confidence of each point).
const SURE: &[(&str, u64)] = &[
    ("olc", 0x05f525625494982e),
    ("ppl", 0xcc17fb7087bc4d6e),
    ("ray", 0x102eea1e28907a18),
    ("plane", 0xe34b4c3710e00bd7),
    ("cp", 0x144f595c45f3811d),
];

/// The map is large enough for confidence to be known.
#[test]
fn bytes_of_confidence_are_pinned() {
    let points = room::<3>(2028, 2100);
    let of = |name: &'static str| {
        let hidden = hide(entry(name), &points, 0);
        let recovered = solve(&hidden.released, &hidden.lists(20, 0.5, 0), joint());
        let rows = recovered.confidence().expect("a map of usual size");
        let bits = rows.iter().flat_map(|one| [one.found, one.scale].map(f32::to_bits));
        (name, hash(&bits.flat_map(u32::to_le_bytes).collect::<Vec<_>>()))
    };
    same(&FIVE.map(of), SURE);
}

const FIVE: [&str; 5] = ["olc", "ppl", "ray", "plane", "cp"];

/// (Solver, hash of the hashes of its recoveries of five schemes).
const BASELINES: &[(&str, u64)] = &[
    ("ransac", 0x4a079b433b6941bc),
    ("density", 0xe4bbc22766efad46),
    ("tomography", 0xe93a13b0d03c11d1),
];

#[test]
fn bytes_of_other_solvers_are_pinned() {
    let points = room::<3>(2029, 300);
    let of = |solver: Builtin| {
        let hashes = FIVE.map(|name| {
            let hidden = hide(entry(name), &points, 0);
            let options = RecoverOptions { seed: 4, ..RecoverOptions::default() };
            let recovered = solve(&hidden.released, &hidden.lists(20, 0.5, 0), (solver, options));
            hash(&recovered_bytes(&recovered)).to_le_bytes()
        });
        (solver.name(), hash(hashes.as_flattened()))
    };
    same(&[Builtin::Ransac, Builtin::Density, Builtin::Tomography].map(of), BASELINES);
}
