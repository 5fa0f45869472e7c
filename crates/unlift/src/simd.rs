//! Run-time choice of vector instructions: the only module with `unsafe`.
//!
//! A [`Kernel`] is plain scalar code, compiled twice: for the portable baseline and for AVX2. The
//! compiler vectorizes both; it never fuses or reorders floating-point operations, so both give
//! the same bits and tests compare them.

#![allow(unsafe_code)]

/// A loop worth compiling for several instruction sets. Implementations, and everything they call
/// in the hot path, are `#[inline(always)]`: only inlined code inherits the instruction set.
pub(crate) trait Kernel {
    /// What the loop returns.
    type Output;

    /// Runs the loop.
    fn run(self) -> Self::Output;
}

/// Runs `kernel` with the best instructions of this machine.
#[inline]
pub(crate) fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    {
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: `run_avx2` needs AVX2 and nothing else; the line above found it.
            return unsafe { run_avx2(kernel) };
        }
    }
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

/// Runs `kernel` with the baseline instructions only: the scalar twin for tests.
#[cfg(test)]
pub(crate) fn portable<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}
