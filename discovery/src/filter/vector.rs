//! Vectors in the widest registers that the processor has.

use cdpr::dynamics::MAX_EFFECT_STATES;
use cdpr::per_cable::MAX_CABLES;

/// Runs a function for which a constant says whether the processor multiplies and adds in one instruction:
/// `vectorised!(FUSED => work::<FUSED>(arguments))`. The function and what it calls must be `#[inline(always)]`: it is compiled
/// once for each kind of processor that is told apart.
macro_rules! vectorised {
    ($fused:ident => $work:expr) => {{
        #[cfg(target_arch = "x86_64")]
        match pulp::Arch::new() {
            pulp::Arch::V4(registers) => vectorised!(registers, $fused => $work),
            pulp::Arch::V3(registers) => vectorised!(registers, $fused => $work),
            _ => {
                const $fused: bool = false;
                $work
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        {
            const $fused: bool = cfg!(target_arch = "aarch64");
            $work
        }
    }};
    ($registers:ident, $fused:ident => $work:expr) => {{
        const $fused: bool = true;
        let once = $crate::filter::vector::Once;
        pulp::Simd::vectorize(
            $registers,
            #[inline(always)]
            || {
                once.used();
                $work
            },
        )
    }};
}
pub(crate) use vectorised;

/// What a closure can use up, so that it can be called but once: a closure that can be called more often is called through
/// a function of its own, which does not take over the wide registers.
pub(crate) struct Once;

impl Once {
    #[inline(always)]
    pub(crate) fn used(self) {}
}

/// Numbers of a full register.
pub(crate) const FULL: usize = 8;
/// Widths of rows with a number for each state: the states of a robot with zeros up to one of these. The last one is that of
/// the most cables with the most states of effects.
pub(crate) const STATES: [usize; 6] = [8, 16, 24, 32, 48, 128];
const _: () = assert!(6 + MAX_CABLES * (2 + MAX_EFFECT_STATES) <= STATES[STATES.len() - 1]);

/// The width of a row with so many states.
pub(crate) fn padded(states: usize) -> usize {
    STATES.into_iter().find(|width| *width >= states).expect("the largest model has no more states")
}
/// Rows that are summed up side by side: one alone would wait for its last sum.
pub(crate) const BLOCK: usize = 4;

/// The scalar product, up to the shorter length. Lengths are multiples of [`FULL`].
#[inline(always)]
pub(crate) fn dot<const FUSED: bool>(a: &[f64], b: &[f64]) -> f64 {
    let mut sum = [0.0; FULL];
    for (a, b) in a.as_chunks::<FULL>().0.iter().zip(b.as_chunks::<FULL>().0) {
        for ((slot, a), b) in sum.iter_mut().zip(a).zip(b) {
            *slot = if FUSED { a.mul_add(*b, *slot) } else { *slot + a * b };
        }
    }
    sum.iter().sum()
}

/// `to + factor * row`. By whole registers, each made at once: number by number the compiler takes them apart.
#[inline(always)]
pub(crate) fn plus<const L: usize, const FUSED: bool>(mut to: [f64; L], factor: f64, row: &[f64; L]) -> [f64; L] {
    const { assert!(L.is_multiple_of(FULL)) };
    for (to, row) in to.as_chunks_mut::<FULL>().0.iter_mut().zip(row.as_chunks::<FULL>().0) {
        *to = std::array::from_fn(|i| if FUSED { factor.mul_add(row[i], to[i]) } else { to[i] + factor * row[i] });
    }
    to
}

/// `to[b] += factors[b] * row` for every row of a block.
#[inline(always)]
pub(crate) fn add_each<const L: usize, const FUSED: bool>(
    to: &mut [[f64; L]; BLOCK],
    factors: &[f64; BLOCK],
    row: &[f64; L],
) {
    for b in 0..BLOCK {
        for i in 0..L {
            to[b][i] = if FUSED { factors[b].mul_add(row[i], to[b][i]) } else { to[b][i] + factors[b] * row[i] };
        }
    }
}

/// The same of rows of one register.
#[inline(always)]
pub(crate) fn plus_each<const FUSED: bool>(to: &mut [[f64; FULL]; BLOCK], factors: &[f64; BLOCK], row: &[f64; FULL]) {
    for b in 0..BLOCK {
        to[b] = plus::<FULL, FUSED>(to[b], factors[b], row);
    }
}

/// Part `at` of a vector that is cut into blocks.
#[inline(always)]
pub(crate) fn block(of: &[f64], at: usize) -> &[f64; BLOCK] {
    &of.as_chunks::<BLOCK>().0[at]
}

/// `to += factor * row`, up to the shorter length.
#[inline(always)]
pub(crate) fn add<const FUSED: bool>(to: &mut [f64], factor: f64, row: &[f64]) {
    for (slot, value) in to.iter_mut().zip(row) {
        *slot = if FUSED { factor.mul_add(*value, *slot) } else { *slot + factor * value };
    }
}
