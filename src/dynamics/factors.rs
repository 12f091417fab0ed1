//! The factors of `σ I - ∂f/∂y`, the matrix of Newton's method, and the solution with them.
//!
//! Velocities are eliminated first (`Δq = (r_q + Δv)/σ`), then each cable's own block; what remains is one 3×3 system
//! in `Δv`.

use super::linearisation::{BLOCK, CableBlock, Linearisation};
use super::matrix3::{self, Field, Matrix3};

/// One cable's part. With `D = σ I - ∂f_c/∂c` over its own states `c`:
#[derive(Clone, Debug)]
struct CableFactors<F> {
    /// `D⁻¹`.
    inverse: [[F; BLOCK]; BLOCK],
    /// Row `∂T/∂c D⁻¹`.
    tension: [F; BLOCK],
    /// That times what the platform's acceleration along the cable does to the rates of `c`.
    tension_by_acceleration: F,
}

/// `(σ I - ∂f/∂y)⁻¹` for one `σ`, real or complex.
#[derive(Clone, Debug)]
pub(crate) struct Factors<F> {
    sigma: F,
    inverse_sigma: F,
    schur_inverse: Matrix3<F>,
    /// `∂(forces)/∂q` with the cables' answer, over `σ`, negative.
    pose_coupling: Matrix3<F>,
    cables: Vec<CableFactors<F>>,
    /// Whether the platform's acceleration acts on states of the cables directly.
    by_acceleration: bool,
}

impl<F: Field> Factors<F> {
    /// Room for the factors of `cables` cables.
    pub(crate) fn empty(cables: usize) -> Self {
        let zero = F::zero();
        let cable =
            CableFactors { inverse: [[zero; BLOCK]; BLOCK], tension: [zero; BLOCK], tension_by_acceleration: zero };
        Self {
            sigma: zero,
            inverse_sigma: zero,
            schur_inverse: [[zero; 3]; 3],
            pose_coupling: [[zero; 3]; 3],
            cables: vec![cable; cables],
            by_acceleration: false,
        }
    }

    /// Factors the linearisation at `sigma`.
    pub(crate) fn update(&mut self, linearisation: &Linearisation, sigma: F) {
        self.sigma = sigma;
        self.inverse_sigma = F::one() / sigma;
        self.by_acceleration = false;
        let mut schur: Matrix3<F> = std::array::from_fn(|r| {
            std::array::from_fn(|c| sigma.scale(linearisation.mass[r][c]) - F::from(linearisation.force_by_twist[r][c]))
        });
        self.pose_coupling = linearisation.force_by_pose.map(|row| row.map(|v| F::from(-v)));
        for (block, factors) in linearisation.cables.iter().zip(&mut self.cables) {
            invert(block, sigma, &mut factors.inverse);
            let n = block.size;
            // The tension's answer to pose, twist, and acceleration along the cable.
            let (mut by_pose, mut by_twist) = ([F::zero(); 3], [F::zero(); 3]);
            let mut by_acceleration = F::zero();
            for c in 0..n {
                let mut sum = F::zero();
                for r in 0..n {
                    sum += factors.inverse[r][c].scale(block.tension_by_state[r]);
                }
                factors.tension[c] = sum;
                for k in 0..3 {
                    by_pose[k] += sum.scale(block.rates_by_pose[c][k]);
                    by_twist[k] += sum.scale(block.rates_by_twist[c][k]);
                }
                by_acceleration += sum.scale(block.rates_by_acceleration[c]);
                self.by_acceleration |= block.rates_by_acceleration[c] != 0.0;
            }
            factors.tension_by_acceleration = by_acceleration;
            let row = block.row.map(F::from);
            for k in 0..3 {
                by_twist[k] += sigma * by_acceleration * row[k];
            }
            matrix3::add_outer(&mut self.pose_coupling, &row, &by_pose, F::one());
            matrix3::add_outer(&mut schur, &row, &by_twist, F::one());
        }
        for r in 0..3 {
            for c in 0..3 {
                self.pose_coupling[r][c] *= self.inverse_sigma;
                schur[r][c] += self.pose_coupling[r][c];
            }
        }
        self.schur_inverse = matrix3::inverse(&schur);
    }

    /// Solves `(σ I - ∂f/∂y) x = b` in place; `offset` is where each cable's states begin.
    #[inline]
    pub(crate) fn solve(&self, linearisation: &Linearisation, offset: &[usize], b: &mut [F]) {
        let rq = [b[0], b[1], b[2]];
        let rv = [b[3], b[4], b[5]];
        let coupled = matrix3::product(&self.pose_coupling, &rq);
        let mut rhs: [F; 3] = std::array::from_fn(|r| along(&linearisation.mass[r], &rv) - coupled[r]);
        for ((block, factors), &first) in linearisation.cables.iter().zip(&self.cables).zip(offset) {
            let own = &b[first..first + block.size];
            let mut tension = F::zero();
            for (t, r) in factors.tension.iter().zip(own) {
                tension += *t * *r;
            }
            if self.by_acceleration {
                tension -= factors.tension_by_acceleration * along(&block.row, &rv);
            }
            for c in 0..3 {
                rhs[c] -= tension.scale(block.row[c]);
            }
        }
        let dv = matrix3::product(&self.schur_inverse, &rhs);
        let dq: [F; 3] = std::array::from_fn(|k| (rq[k] + dv[k]) * self.inverse_sigma);
        for ((block, factors), &first) in linearisation.cables.iter().zip(&self.cables).zip(offset) {
            let own = &mut b[first..first + block.size];
            if self.by_acceleration {
                // The acceleration's own change is σ Δv less its right-hand side.
                let acceleration = along(&block.row, &dv) * self.sigma - along(&block.row, &rv);
                for (right, by) in own.iter_mut().zip(&block.rates_by_acceleration) {
                    *right += acceleration.scale(*by);
                }
            }
            match own.len() {
                0 => {}
                1 => factors.answer::<1>(block, &dq, &dv, own),
                2 => factors.answer::<2>(block, &dq, &dv, own),
                3 => factors.answer::<3>(block, &dq, &dv, own),
                4 => factors.answer::<4>(block, &dq, &dv, own),
                _ => {
                    let mut padded = [F::zero(); BLOCK];
                    padded[..own.len()].copy_from_slice(own);
                    factors.answer::<BLOCK>(block, &dq, &dv, &mut padded);
                    own.copy_from_slice(&padded[..own.len()]);
                }
            }
        }
        b[..3].copy_from_slice(&dq);
        b[3..6].copy_from_slice(&dv);
    }
}

/// A real row times a vector.
#[inline]
fn along<F: Field>(row: &[f64; 3], v: &[F; 3]) -> F {
    v[0].scale(row[0]) + v[1].scale(row[1]) + v[2].scale(row[2])
}

impl<F: Field> CableFactors<F> {
    /// The cable's own states from their right-hand sides and the platform's motion.
    #[inline]
    fn answer<const N: usize>(&self, block: &CableBlock, dq: &[F; 3], dv: &[F; 3], own: &mut [F]) {
        let right: [F; N] =
            std::array::from_fn(|c| own[c] + along(&block.rates_by_pose[c], dq) + along(&block.rates_by_twist[c], dv));
        for r in 0..N {
            let mut sum = F::zero();
            for c in 0..N {
                sum += self.inverse[r][c] * right[c];
            }
            own[r] = sum;
        }
    }
}

/// Inverse of `σ I - C` by Gauss-Jordan, two states in closed form. No pivoting: the diagonal is `σ` plus decay rates, and the spring's entry has
/// the sign that adds to it.
fn invert<F: Field>(block: &CableBlock, sigma: F, inverse: &mut [[F; BLOCK]; BLOCK]) {
    let n = block.size;
    if n == 2 {
        let [[a, b], [c, d]] = [0, 1].map(|r| [0, 1].map(|c| F::from(-block.rates_by_state[r][c])));
        let (a, d) = (a + sigma, d + sigma);
        let scale = F::one() / (a * d - b * c);
        inverse[0][..2].copy_from_slice(&[d * scale, -b * scale]);
        inverse[1][..2].copy_from_slice(&[-c * scale, a * scale]);
        return;
    }
    let mut m = [[F::zero(); BLOCK]; BLOCK];
    for r in 0..n {
        for c in 0..n {
            let unit = if r == c { (sigma, F::one()) } else { (F::zero(), F::zero()) };
            m[r][c] = unit.0 - F::from(block.rates_by_state[r][c]);
            inverse[r][c] = unit.1;
        }
    }
    for p in 0..n {
        let scale = F::one() / m[p][p];
        for c in 0..n {
            m[p][c] *= scale;
            inverse[p][c] *= scale;
        }
        for r in 0..n {
            if r != p {
                let factor = m[r][p];
                for c in 0..n {
                    let (a, b) = (m[p][c], inverse[p][c]);
                    m[r][c] -= factor * a;
                    inverse[r][c] -= factor * b;
                }
            }
        }
    }
}
