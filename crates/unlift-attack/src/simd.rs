//! Vector instructions, chosen at run time. This is the only module with `unsafe`.
//!
//! A [`Kernel`] is scalar code, vectorized by the compiler for the baseline and for AVX2. Both give the same bits; tests compare them.

#![allow(unsafe_code)]

/// A loop for several instruction sets. Implementations, and all that they call in the hot path, are `#[inline(always)]`.
pub trait Kernel {
    /// What the loop returns.
    type Output;

    /// Runs the loop.
    fn run(self) -> Self::Output;
}

/// Runs `kernel` with the best instruction set of this machine.
#[inline]
pub fn dispatch<K: Kernel>(kernel: K) -> K::Output {
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

/// Prefetches `row[at]`, where the machine has an instruction for that. It changes no result.
#[inline(always)]
pub(crate) fn prefetch<T>(rows: &[T], at: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let row = rows.as_ptr().wrapping_add(at);
        // SAFETY: every x86-64 machine has the instruction; it is a hint that accesses no memory and never faults.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(row.cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (rows, at);
}

/// Rows and columns of a block of [`raise_to_products`].
pub(crate) const BLOCK: usize = 128;
/// Adjacent columns in a packed right factor.
const PANEL: usize = 16;
/// Adjacent values of one column in it.
pub(crate) const QUAD: usize = 4;

/// Raises `best[i][j]` to the product of row `i` of `left` with column `j` of `right`.
///
/// `left` has [`BLOCK`] rows of `depth` values. `right` has [`BLOCK`] columns of `depth` values, each at the index that [`packed`] returns.
/// `best` is `(BLOCK, BLOCK)`, row-major. Intrinsics do up to 64 multiplications at once, far more than vectorized loops.
///
/// Values are at most 127, and no product of two rows may exceed `i16::MAX`, which rows of Euclidean norm below 181 never do.
///
/// # Panics
/// When a length does not fit, or `depth` is not a multiple of 8.
pub(crate) fn raise_to_products(left: &[u8], right: &[i8], depth: usize, best: &mut [i16]) {
    assert!(depth.is_multiple_of(2 * QUAD) && left.len() == BLOCK * depth);
    assert!(right.len() == BLOCK * depth && best.len() == BLOCK * BLOCK);
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::is_x86_feature_detected as has;
        if has!("avx512f") && has!("avx512vnni") {
            // SAFETY: the function needs these two and nothing else; the line above found them.
            return unsafe { raise_vnni(left, right, depth, best) };
        }
        if has!("avx2") {
            // SAFETY: the function needs AVX2 and nothing else; the line above found it.
            return unsafe { raise_avx2(left, right, depth, best) };
        }
    }
    raise_portable(left, right, depth, best);
}

/// Returns the index of value `at` of column `column` in a packed right factor of `depth` values.
#[inline(always)]
pub(crate) fn packed(column: usize, at: usize, depth: usize) -> usize {
    let panel = (column / PANEL) * PANEL * depth;
    panel + (at / QUAD) * PANEL * QUAD + (column % PANEL) * QUAD + at % QUAD
}

fn raise_portable(left: &[u8], right: &[i8], depth: usize, best: &mut [i16]) {
    for i in 0..BLOCK {
        let row = &left[i * depth..(i + 1) * depth];
        for panel in 0..BLOCK / PANEL {
            let columns = &right[panel * PANEL * depth..(panel + 1) * PANEL * depth];
            let mut sums = [0i32; PANEL];
            for (quad, four) in columns.chunks_exact(PANEL * QUAD).zip(row.chunks_exact(QUAD)) {
                for (sum, values) in sums.iter_mut().zip(quad.chunks_exact(QUAD)) {
                    for (&a, &b) in four.iter().zip(values) {
                        *sum += i32::from(a) * i32::from(b);
                    }
                }
            }
            let at = i * BLOCK + panel * PANEL;
            for (best, &sum) in best[at..at + PANEL].iter_mut().zip(&sums) {
                *best = (*best).max(sum as i16);
            }
        }
    }
}

/// The version for AVX2. Rows are arrays: a build with debug assertions would check loads through pointers one by one.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn raise_avx2(left: &[u8], right: &[i8], depth: usize, best: &mut [i16]) {
    use std::arch::x86_64::*;
    const ROWS: usize = 4;
    let ones = _mm256_set1_epi16(1);
    // SAFETY: both have 32 bytes, and every value of them is valid.
    let wide = |values: &[i8; 32]| -> __m256i { unsafe { std::mem::transmute(*values) } };
    // Two quads at a time.
    let n = depth / (2 * QUAD);
    for (panel, columns) in right.chunks_exact(PANEL * depth).enumerate() {
        let columns = &columns.as_chunks::<32>().0.as_chunks::<4>().0[..n];
        for (first, rows) in left.chunks_exact(ROWS * depth).enumerate() {
            let rows = rows.as_chunks::<QUAD>().0.as_chunks::<2>().0;
            // Closures would not be inlined here: functions of the standard library do not call for AVX2.
            let (a, b) = (&rows[..n], &rows[n..][..n]);
            let (c, d) = (&rows[2 * n..][..n], &rows[3 * n..][..n]);
            let mut sums = [[_mm256_setzero_si256(); 2]; ROWS];
            for at in 0..n {
                for quad in 0..2 {
                    let [low, high] =
                        [wide(&columns[at][2 * quad]), wide(&columns[at][2 * quad + 1])];
                    for (row, sums) in [a, b, c, d].into_iter().zip(&mut sums) {
                        let four = _mm256_set1_epi32(i32::from_le_bytes(row[at][quad]));
                        // Pairs of products and their sums fit 16 bits, see the caller.
                        sums[0] = _mm256_add_epi16(sums[0], _mm256_maddubs_epi16(four, low));
                        sums[1] = _mm256_add_epi16(sums[1], _mm256_maddubs_epi16(four, high));
                    }
                }
            }
            for (row, [low, high]) in sums.into_iter().enumerate() {
                let sum =
                    _mm256_packs_epi32(_mm256_madd_epi16(low, ones), _mm256_madd_epi16(high, ones));
                // Packing interleaves the two halves of each register; the permutation restores the order.
                let sum = _mm256_permute4x64_epi64(sum, 0b11_01_10_00);
                let at = (first * ROWS + row) * BLOCK + panel * PANEL;
                let best = &mut best[at..at + PANEL].as_chunks_mut::<PANEL>().0[0];
                // SAFETY: as above.
                *best = unsafe {
                    let before = std::mem::transmute::<[i16; PANEL], __m256i>(*best);
                    std::mem::transmute::<__m256i, [i16; PANEL]>(_mm256_max_epi16(before, sum))
                };
            }
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vnni")]
fn raise_vnni(left: &[u8], right: &[i8], depth: usize, best: &mut [i16]) {
    use std::arch::x86_64::*;
    // As many rows as panels: each vector that is loaded serves four products.
    const WIDE: usize = 4;
    let n_quads = depth / QUAD;
    // SAFETY: both have 64 bytes, and every value of them is valid.
    let wide = |values: &[i8; 64]| -> __m512i { unsafe { std::mem::transmute(*values) } };
    for (group, columns) in right.chunks_exact(WIDE * PANEL * depth).enumerate() {
        let panels: [&[[i8; 64]]; WIDE] =
            std::array::from_fn(|at| &columns[at * PANEL * depth..].as_chunks().0[..n_quads]);
        for (first, rows) in left.chunks_exact(WIDE * depth).enumerate() {
            let rows: [&[[u8; QUAD]]; WIDE] =
                std::array::from_fn(|at| &rows[at * depth..].as_chunks().0[..n_quads]);
            let mut sums = [[_mm512_setzero_si512(); WIDE]; WIDE];
            for quad in 0..n_quads {
                let columns = panels.map(|panel| wide(&panel[quad]));
                for (row, sums) in rows.iter().zip(&mut sums) {
                    let four = _mm512_set1_epi32(i32::from_le_bytes(row[quad]));
                    for (sum, columns) in sums.iter_mut().zip(columns) {
                        *sum = _mm512_dpbusd_epi32(*sum, four, columns);
                    }
                }
            }
            for (row, sums) in sums.into_iter().enumerate() {
                let at = (first * WIDE + row) * BLOCK + group * WIDE * PANEL;
                let best = best[at..at + WIDE * PANEL].as_chunks_mut::<PANEL>().0;
                for (best, sum) in best.iter_mut().zip(sums) {
                    // SAFETY: as above.
                    *best = unsafe {
                        let before = std::mem::transmute::<[i16; PANEL], __m256i>(*best);
                        let sum = _mm512_cvtepi32_epi16(sum);
                        std::mem::transmute::<__m256i, [i16; PANEL]>(_mm256_max_epi16(before, sum))
                    };
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::{Draws, Stage};

    #[test]
    fn all_versions_of_the_block_product_agree_with_plain_sums() {
        // Miri takes minutes for more.
        let depths: &[usize] = if cfg!(miri) { &[8, 16] } else { &[8, 24, 128] };
        for &depth in depths {
            let mut draws = Draws::new(1, Stage::Synthetic, depth as u64);
            let most = (32_767.0 / depth as f64).sqrt() as u64;
            let left: Vec<u8> = (0..BLOCK * depth).map(|_| draws.below(most) as u8).collect();
            let plain: Vec<i8> = (0..BLOCK * depth).map(|_| draws.below(most) as i8).collect();
            let mut right = vec![0; BLOCK * depth];
            for column in 0..BLOCK {
                for at in 0..depth {
                    right[packed(column, at, depth)] = plain[column * depth + at];
                }
            }
            let mut best: Vec<i16> = vec![0; BLOCK * BLOCK];
            best[5] = i16::MAX;
            let [mut portable, mut narrow] = [best.clone(), best.clone()];
            raise_to_products(&left, &right, depth, &mut best);
            raise_portable(&left, &right, depth, &mut portable);
            assert_eq!(best, portable);
            #[cfg(target_arch = "x86_64")]
            if std::arch::is_x86_feature_detected!("avx2") {
                // SAFETY: the function needs AVX2 and nothing else; the line above found it.
                unsafe { raise_avx2(&left, &right, depth, &mut narrow) };
                assert_eq!(best, narrow);
            }
            assert_eq!(best[5], i16::MAX);
            let (i, j) = (77, 42);
            let sum: i32 = (0..depth)
                .map(|k| i32::from(left[i * depth + k]) * i32::from(plain[j * depth + k]))
                .sum();
            assert_eq!(i32::from(best[i * BLOCK + j]), sum);
        }
    }
}
