//! `joint-start` gives the same result alone and as a part of `joint`.

use unlift::obfuscate::Entry;
use unlift::recover::{Builtin, RecoverOptions, Unknown, recover, recover_with_start};

use crate::maps::{hide, recovered_bytes, room};

fn the_start_is_a_solver_of_its_own<const D: usize>(name: &str, scheme: &Entry) {
    let hidden = hide::<D>(scheme, &room(5, 400), 5);
    let lists = hidden.lists(12, 0.5, 5);
    let options = RecoverOptions { seed: 2, ..RecoverOptions::default() };
    let alone = |solver: Builtin| recover(&hidden.released, &lists, &solver, &options).unwrap();
    let (joint, start) = recover_with_start(&hidden.released, &lists, &options).unwrap();
    assert_eq!(recovered_bytes(&joint), recovered_bytes(&alone(Builtin::Joint)), "{name}");
    let of_start = alone(Builtin::JointStart);
    assert_eq!(recovered_bytes(&start), recovered_bytes(&of_start), "{name}");
    for start in [&start, &of_start] {
        assert_eq!(start.confidence_unknown(), Some(Unknown::OtherSolver), "{name}");
    }
    assert_eq!(start.delta(), joint.delta(), "{name}");
}

#[test]
fn the_start_of_joint_recovery_is_a_solver_of_its_own() {
    over_schemes!(the_start_is_a_solver_of_its_own);
}
