//! Vectors in the widest registers that the processor has.

/// Runs a function for which a constant says whether the processor multiplies and adds in one instruction:
/// `vectorised!(FUSED => work::<FUSED>(arguments))`. The function and what it calls must be `#[inline(always)]`.
macro_rules! vectorised {
    ($fused:ident => $work:expr) => {{
        let once = $crate::vector::Once;
        if $crate::vector::fuses() {
            const $fused: bool = true;
            pulp::Arch::new().dispatch(
                #[inline(always)]
                || {
                    once.used();
                    $work
                },
            )
        } else {
            const $fused: bool = false;
            $work
        }
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

/// Whether the processor multiplies and adds in one instruction. Elsewhere a fused product is a slow library call.
pub(crate) fn fuses() -> bool {
    #[cfg(target_arch = "x86_64")]
    return std::arch::is_x86_feature_detected!("fma") && std::arch::is_x86_feature_detected!("avx2");
    #[cfg(not(target_arch = "x86_64"))]
    return cfg!(target_arch = "aarch64");
}

/// `to += factor * row`, up to the shorter length.
#[inline(always)]
pub(crate) fn add<const FUSED: bool>(to: &mut [f64], factor: f64, row: &[f64]) {
    for (slot, value) in to.iter_mut().zip(row) {
        *slot = if FUSED { factor.mul_add(*value, *slot) } else { *slot + factor * value };
    }
}
