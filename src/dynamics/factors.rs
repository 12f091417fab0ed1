//! The factors of `σ I - ∂f/∂y`, the matrix of Newton's method, for a real and a complex `σ`, and the solution with them.
//!
//! Velocities are eliminated first (`Δq = (r_q + Δv)/σ`), then each cable's own block; what remains is one 3×3 system
//! in `Δv`. Nothing but the factors is read in a solution, and they lie together: they are most of what an instance keeps warm.

use std::ops::Range;

use num_complex::Complex64;

use super::columns::{Column, Pairs, Part, Reals, Split};
use super::linearisation::{BLOCK, CableBlock, Linearisation, StateBlock};
use super::matrix3::{self, Field, Matrix3};

/// The platform's part for one `σ`.
#[derive(Clone, Debug)]
struct Platform<F> {
    sigma: F,
    inverse_sigma: F,
    schur_inverse: Matrix3<F>,
    /// `∂(forces)/∂q` with the cables' answer, over `σ`, negative.
    pose_coupling: Matrix3<F>,
}

/// One cable's part for one `σ`. With `D = σ I - ∂f_c/∂c` over its own states `c`:
#[derive(Clone, Copy, Debug)]
struct Own<F, P, const N: usize> {
    /// `D⁻¹`, by columns.
    inverse: [P; N],
    /// Row `∂T/∂c D⁻¹`.
    tension: P,
    /// That times what the platform's acceleration along the cable does to the rates of `c`.
    tension_by_acceleration: F,
}

/// One cable with up to `N` states; zero beyond its last.
#[derive(Clone, Copy, Debug)]
struct Cable<const N: usize> {
    row: [f64; 3],
    /// By columns.
    rates_by_pose: [Reals<N>; 3],
    rates_by_twist: [Reals<N>; 3],
    real: Own<f64, Reals<N>, N>,
    complex: Own<Complex64, Pairs<N>, N>,
    rates_by_acceleration: Reals<N>,
}

/// The cables, with room for the most states that one of them has.
#[derive(Clone, Debug)]
enum Cables {
    None(Vec<Cable<0>>),
    One(Vec<Cable<1>>),
    Two(Vec<Cable<2>>),
    Three(Vec<Cable<3>>),
    Four(Vec<Cable<4>>),
    Most(Vec<Cable<BLOCK>>),
}

/// What all cables have in common.
#[derive(Clone, Debug)]
struct Common {
    mass: Matrix3<f64>,
    real: Platform<f64>,
    complex: Platform<Complex64>,
    /// Whether the platform's acceleration acts on states of the cables directly.
    by_acceleration: bool,
    /// All cables have as many states as there is room for.
    alike: bool,
    /// Each cable's states.
    states: Vec<Range<usize>>,
}

/// `(σ I - ∂f/∂y)⁻¹` for a real and a complex `σ`.
#[derive(Clone, Debug)]
pub(crate) struct Factors {
    common: Common,
    cables: Cables,
}

/// Runs `$body` with the cables, whatever their room.
macro_rules! with_cables {
    ($cables:expr, $list:ident => $body:expr) => {
        match $cables {
            Cables::None($list) => $body,
            Cables::One($list) => $body,
            Cables::Two($list) => $body,
            Cables::Three($list) => $body,
            Cables::Four($list) => $body,
            Cables::Most($list) => $body,
        }
    };
}

impl Factors {
    /// Room for the factors of cables that have these `states`.
    pub(crate) fn new(states: Vec<Range<usize>>) -> Self {
        let count = states.len();
        let (cables, room) = match states.iter().map(Range::len).max().unwrap_or(0) {
            0 => (Cables::None(vec![Cable::ZERO; count]), 0),
            1 => (Cables::One(vec![Cable::ZERO; count]), 1),
            2 => (Cables::Two(vec![Cable::ZERO; count]), 2),
            3 => (Cables::Three(vec![Cable::ZERO; count]), 3),
            4 => (Cables::Four(vec![Cable::ZERO; count]), 4),
            _ => (Cables::Most(vec![Cable::ZERO; count]), BLOCK),
        };
        let alike = states.iter().enumerate().all(|(i, states)| *states == (6 + i * room..6 + (i + 1) * room));
        let common = Common {
            mass: [[0.0; 3]; 3],
            real: Platform::empty(),
            complex: Platform::empty(),
            by_acceleration: false,
            alike,
            states,
        };
        Self { common, cables }
    }

    /// Factors the linearisation at `real` and at `complex`.
    pub(crate) fn update(&mut self, linearisation: &Linearisation, real: f64, complex: Complex64) {
        let acts = |block: &CableBlock| block.states.iter().any(|state| state.rate_by_acceleration != 0.0);
        self.common.by_acceleration = linearisation.cables.iter().any(acts);
        self.common.mass = linearisation.mass;
        with_cables!(&mut self.cables, cables => {
            for (cable, block) in cables.iter_mut().zip(&linearisation.cables) {
                cable.take_up(block);
            }
            self.common.real = factor(linearisation, real, cables, |cable| &mut cable.real);
            self.common.complex = factor(linearisation, complex, cables, |cable| &mut cable.complex);
        });
    }

    /// Solves `(σ I - ∂f/∂y) x = b` in place for the real `σ`.
    #[inline]
    pub(crate) fn solve_real(&self, b: &mut [f64]) {
        let common = &self.common;
        with_cables!(&self.cables, cables => common.solve(&common.real, cables, |cable| &cable.real, b));
    }

    /// The same for the complex `σ`, of real and imaginary parts.
    #[inline]
    pub(crate) fn solve_complex(&self, re: &mut [f64], im: &mut [f64]) {
        let (common, b) = (&self.common, &mut Split { re, im });
        with_cables!(&self.cables, cables => common.solve(&common.complex, cables, |cable| &cable.complex, b));
    }
}

impl Common {
    #[inline]
    fn solve<F: Field, C: Column<F> + ?Sized, const N: usize>(
        &self,
        platform: &Platform<F>,
        cables: &[Cable<N>],
        own: impl Fn(&Cable<N>) -> &Own<F, C::Part<N>, N>,
        b: &mut C,
    ) {
        if self.alike {
            self.solve_with(platform, cables, own, |i| (6 + i * N, N), b);
        } else {
            self.solve_with(platform, cables, own, |i| (self.states[i].start, self.states[i].len()), b);
        }
    }

    /// `states` says where a cable's states begin and how many there are.
    #[inline(always)]
    fn solve_with<F: Field, C: Column<F> + ?Sized, const N: usize>(
        &self,
        platform: &Platform<F>,
        cables: &[Cable<N>],
        own: impl Fn(&Cable<N>) -> &Own<F, C::Part<N>, N>,
        states: impl Fn(usize) -> (usize, usize),
        b: &mut C,
    ) {
        let (rq, rv) = ([b.get(0), b.get(1), b.get(2)], [b.get(3), b.get(4), b.get(5)]);
        let mut rhs = platform.side(&self.mass, &rq, &rv);
        for (i, cable) in cables.iter().enumerate() {
            let (first, count) = states(i);
            let own = own(cable);
            let mut tension = own.tension.dot(&b.take(first, count));
            if self.by_acceleration {
                tension -= own.tension_by_acceleration * along(&cable.row, &rv);
            }
            for c in 0..3 {
                rhs[c] -= tension.scale(cable.row[c]);
            }
        }
        let dv = matrix3::product(&platform.schur_inverse, &rhs);
        let dq: [F; 3] = std::array::from_fn(|k| (rq[k] + dv[k]) * platform.inverse_sigma);
        for (i, cable) in cables.iter().enumerate() {
            let (first, count) = states(i);
            let mut right: C::Part<N> = b.take(first, count);
            if self.by_acceleration {
                // The acceleration's own change is σ Δv less its right-hand side.
                let change = along(&cable.row, &dv) * platform.sigma - along(&cable.row, &rv);
                right = right.plus(&[cable.rates_by_acceleration], &[change]);
            }
            let right = right.plus(&cable.rates_by_pose, &dq).plus(&cable.rates_by_twist, &dv);
            b.put(first, count, &right.under(&own(cable).inverse));
        }
        for k in 0..3 {
            b.set(k, dq[k]);
            b.set(3 + k, dv[k]);
        }
    }
}

/// A real row times a vector.
#[inline(always)]
fn along<F: Field>(row: &[f64; 3], v: &[F; 3]) -> F {
    v[0].scale(row[0]) + v[1].scale(row[1]) + v[2].scale(row[2])
}

impl<F: Field> Platform<F> {
    fn empty() -> Self {
        let zeros = [[F::zero(); 3]; 3];
        Self { sigma: F::zero(), inverse_sigma: F::zero(), schur_inverse: zeros, pose_coupling: zeros }
    }

    /// The right-hand side of the platform's three equations, the cables' answers aside.
    #[inline(always)]
    fn side(&self, mass: &Matrix3<f64>, rq: &[F; 3], rv: &[F; 3]) -> [F; 3] {
        let coupled = matrix3::product(&self.pose_coupling, rq);
        std::array::from_fn(|r| along(&mass[r], rv) - coupled[r])
    }
}

impl<const N: usize> Cable<N> {
    const ZERO: Self = Self {
        row: [0.0; 3],
        rates_by_pose: [[0.0; N]; 3],
        rates_by_twist: [[0.0; N]; 3],
        real: Own { inverse: [[0.0; N]; N], tension: [0.0; N], tension_by_acceleration: 0.0 },
        complex: Own { inverse: [Pairs::ZERO; N], tension: Pairs::ZERO, tension_by_acceleration: Complex64::ZERO },
        rates_by_acceleration: [0.0; N],
    };

    /// What does not depend on `σ`.
    fn take_up(&mut self, block: &CableBlock) {
        self.row = block.row;
        for (c, state) in block.states.iter().enumerate().take(N) {
            for k in 0..3 {
                self.rates_by_pose[k][c] = state.rate_by_pose[k];
                self.rates_by_twist[k][c] = state.rate_by_twist[k];
            }
            self.rates_by_acceleration[c] = state.rate_by_acceleration;
        }
    }
}

/// Factors the linearisation at `sigma`: the cables' parts into `cables`, and the platform's.
fn factor<F: Field, P: Part<F, N>, const N: usize>(
    linearisation: &Linearisation,
    sigma: F,
    cables: &mut [Cable<N>],
    own: impl Fn(&mut Cable<N>) -> &mut Own<F, P, N>,
) -> Platform<F> {
    let mut schur: Matrix3<F> = std::array::from_fn(|r| {
        std::array::from_fn(|c| sigma.scale(linearisation.mass[r][c]) - F::from(linearisation.force_by_twist[r][c]))
    });
    let mut pose_coupling = linearisation.force_by_pose.map(|row| row.map(|v| F::from(-v)));
    for (cable, block) in cables.iter_mut().zip(&linearisation.cables) {
        let states = &block.states[..block.states.len().min(N)];
        let inverse: [[F; N]; N] = invert(states, sigma);
        // The tension's answer to own states, pose, twist, and acceleration along the cable.
        let mut tension = [F::zero(); N];
        let (mut by_pose, mut by_twist) = ([F::zero(); 3], [F::zero(); 3]);
        let mut by_acceleration = F::zero();
        for (c, state) in states.iter().enumerate() {
            let mut sum = F::zero();
            for (r, other) in states.iter().enumerate() {
                sum += inverse[r][c].scale(other.tension);
            }
            tension[c] = sum;
            for k in 0..3 {
                by_pose[k] += sum.scale(state.rate_by_pose[k]);
                by_twist[k] += sum.scale(state.rate_by_twist[k]);
            }
            by_acceleration += sum.scale(state.rate_by_acceleration);
        }
        *own(cable) = Own {
            inverse: std::array::from_fn(|c| P::from_fn(|r| inverse[r][c])),
            tension: P::from_fn(|c| tension[c]),
            tension_by_acceleration: by_acceleration,
        };
        let row = block.row.map(F::from);
        for k in 0..3 {
            by_twist[k] += sigma * by_acceleration * row[k];
        }
        matrix3::add_outer(&mut pose_coupling, &row, &by_pose, F::one());
        matrix3::add_outer(&mut schur, &row, &by_twist, F::one());
    }
    let inverse_sigma = F::one() / sigma;
    for r in 0..3 {
        for c in 0..3 {
            pose_coupling[r][c] *= inverse_sigma;
            schur[r][c] += pose_coupling[r][c];
        }
    }
    Platform { sigma, inverse_sigma, schur_inverse: matrix3::inverse(&schur), pose_coupling }
}

/// Inverse of `σ I - C` over a cable's states by Gauss-Jordan, two states in closed form. No pivoting: the diagonal is `σ`
/// plus decay rates, and the spring's entry has the sign that adds to it.
fn invert<F: Field, const N: usize>(states: &[StateBlock], sigma: F) -> [[F; N]; N] {
    let n = states.len();
    let mut inverse = [[F::zero(); N]; N];
    if n == 2 {
        let [[a, b], [c, d]] = [0, 1].map(|r| [0, 1].map(|c| F::from(-states[r].rate_by_state[c])));
        let (a, d) = (a + sigma, d + sigma);
        let scale = F::one() / (a * d - b * c);
        inverse[0][..2].copy_from_slice(&[d * scale, -b * scale]);
        inverse[1][..2].copy_from_slice(&[-c * scale, a * scale]);
        return inverse;
    }
    let mut m = [[F::zero(); N]; N];
    for r in 0..n {
        for c in 0..n {
            let unit = if r == c { (sigma, F::one()) } else { (F::zero(), F::zero()) };
            m[r][c] = unit.0 - F::from(states[r].rate_by_state[c]);
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
    inverse
}
