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
        let size = linearisation.cables.first().map_or(0, |block| block.size);
        let alike = linearisation.cables.iter().all(|block| block.size == size);
        match if self.by_acceleration || !alike { 0 } else { size } {
            1 => self.solve_alike::<1>(linearisation, b),
            2 => self.solve_alike::<2>(linearisation, b),
            3 => self.solve_alike::<3>(linearisation, b),
            4 => self.solve_alike::<4>(linearisation, b),
            _ => self.solve_any(linearisation, offset, b),
        }
    }

    /// The same where every cable has `N` states, on which the platform's acceleration does not act.
    #[inline]
    fn solve_alike<const N: usize>(&self, linearisation: &Linearisation, b: &mut [F]) {
        let (platform, own) = b.split_at_mut(6);
        let own = own.as_chunks_mut::<N>().0;
        let rq = [platform[0], platform[1], platform[2]];
        let mut rhs = self.platform_side(linearisation, &rq, &[platform[3], platform[4], platform[5]]);
        for ((block, factors), own) in linearisation.cables.iter().zip(&self.cables).zip(&*own) {
            let mut tension = F::zero();
            for c in 0..N {
                tension += factors.tension[c] * own[c];
            }
            for c in 0..3 {
                rhs[c] -= tension.scale(block.row[c]);
            }
        }
        let (dq, dv) = self.motion(&rq, &rhs);
        for ((block, factors), own) in linearisation.cables.iter().zip(&self.cables).zip(own) {
            factors.answer::<N>(block, &dq, &dv, own);
        }
        platform[..3].copy_from_slice(&dq);
        platform[3..].copy_from_slice(&dv);
    }

    fn solve_any(&self, linearisation: &Linearisation, offset: &[usize], b: &mut [F]) {
        let rq = [b[0], b[1], b[2]];
        let rv = [b[3], b[4], b[5]];
        let mut rhs = self.platform_side(linearisation, &rq, &rv);
        for ((block, factors), &first) in linearisation.cables.iter().zip(&self.cables).zip(offset) {
            let own = &b[first..first + block.size];
            let mut tension = -(factors.tension_by_acceleration * along(&block.row, &rv));
            for (t, r) in factors.tension.iter().zip(own) {
                tension += *t * *r;
            }
            for c in 0..3 {
                rhs[c] -= tension.scale(block.row[c]);
            }
        }
        let (dq, dv) = self.motion(&rq, &rhs);
        for ((block, factors), &first) in linearisation.cables.iter().zip(&self.cables).zip(offset) {
            if block.size == 0 {
                continue;
            }
            let mut own = [F::zero(); BLOCK];
            own[..block.size].copy_from_slice(&b[first..first + block.size]);
            // The acceleration's own change is σ Δv less its right-hand side.
            let acceleration = along(&block.row, &dv) * self.sigma - along(&block.row, &rv);
            for (right, by) in own.iter_mut().zip(&block.rates_by_acceleration).take(block.size) {
                *right += acceleration.scale(*by);
            }
            match block.size {
                1 => factors.answer::<1>(block, &dq, &dv, &mut own),
                2 => factors.answer::<2>(block, &dq, &dv, &mut own),
                3 => factors.answer::<3>(block, &dq, &dv, &mut own),
                4 => factors.answer::<4>(block, &dq, &dv, &mut own),
                _ => factors.answer::<BLOCK>(block, &dq, &dv, &mut own),
            }
            b[first..first + block.size].copy_from_slice(&own[..block.size]);
        }
        b[..3].copy_from_slice(&dq);
        b[3..6].copy_from_slice(&dv);
    }

    /// The right-hand side of the platform's three equations, the cables' answers aside.
    #[inline]
    fn platform_side(&self, linearisation: &Linearisation, rq: &[F; 3], rv: &[F; 3]) -> [F; 3] {
        let coupled = matrix3::product(&self.pose_coupling, rq);
        std::array::from_fn(|r| along(&linearisation.mass[r], rv) - coupled[r])
    }

    /// Change of pose and twist.
    #[inline]
    fn motion(&self, rq: &[F; 3], rhs: &[F; 3]) -> ([F; 3], [F; 3]) {
        let dv = matrix3::product(&self.schur_inverse, rhs);
        (std::array::from_fn(|k| (rq[k] + dv[k]) * self.inverse_sigma), dv)
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

/// Inverse of `σ I - C` by Gauss-Jordan, two states in closed form. No pivoting: the diagonal is `σ` plus decay rates, and
/// the spring's entry has the sign that adds to it.
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
