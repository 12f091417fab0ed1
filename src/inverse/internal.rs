//! What elastic cables remember: paid-out lengths behind a damper, and the states of elastic laws.

use nalgebra::DMatrix;
use num_dual::Dual64;

use super::{InverseDynamics, InverseError, Jet};
use crate::dynamics::{Held, MAX_EFFECT_STATES};
use crate::integrator::{Complex64, DenseFactors, System};
use crate::parameters::CableModel;
use crate::per_cable::PerCable;
use crate::plant::Plant;
use crate::scalar::Real;

/// A pole `EA/(b l)` (1/s) no faster than this does not keep up with the motions of a large robot.
const SLOW_POLE: f64 = 10.0;

/// What acts on the cables' elastic side at one instant.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drive {
    pub(super) time: Jet,
    pub(super) length: PerCable<Jet>,
    pub(super) speed: PerCable<Jet>,
    pub(super) tension: PerCable<Jet>,
}

/// Paid-out lengths and elastic-law states with their derivatives.
pub(super) struct ElasticJets {
    pub(super) unstretched: PerCable<Jet>,
    pub(super) states: PerCable<[Jet; MAX_EFFECT_STATES]>,
}

/// One cable's part of the internal states.
#[derive(Clone, Debug)]
struct CableLayout {
    offset: usize,
    /// The paid-out length is an internal state: elastic cable with damping.
    has_length: bool,
    /// Places of the elastic law's states among the cable's effect states.
    slots: Vec<usize>,
}

/// Where each cable's internal states are.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    cables: Vec<CableLayout>,
    dimension: usize,
}

impl Layout {
    pub(super) fn new(plant: &Plant) -> Self {
        let mut dimension = 0;
        let layout = |i: usize| {
            let data = &plant.data().cables[i];
            let has_length = data.model != CableModel::Rigid && data.damping > 0.0;
            let slots = plant.cable[i].law.iter().flat_map(|(kind, at)| *at..*at + kind.states()).collect();
            let cable = CableLayout { offset: dimension, has_length, slots };
            dimension += usize::from(has_length) + cable.slots.len();
            cable
        };
        let cables = (0..plant.cables()).map(layout).collect();
        Self { cables, dimension }
    }

    pub(super) fn dimension(&self) -> usize {
        self.dimension
    }

    fn is_elastic(plant: &Plant, cable: usize) -> bool {
        plant.data().cables[cable].model != CableModel::Rigid
    }

    /// Elastic-law states of `cable` in their places.
    fn law_states<S: Real>(&self, cable: usize, internal: &[S]) -> [S; MAX_EFFECT_STATES] {
        let layout = &self.cables[cable];
        let mut states = [S::from(0.0); MAX_EFFECT_STATES];
        let first = layout.offset + usize::from(layout.has_length);
        for (k, slot) in layout.slots.iter().enumerate() {
            states[*slot] = internal[first + k];
        }
        states
    }

    /// Rates of one cable's internal states, in the order of its states.
    fn cable_rates<S: Real>(
        &self,
        plant: &Plant,
        cable: usize,
        [time, length, speed, tension]: [S; 4],
        internal: &[S],
        rates: &mut [S],
    ) {
        let (layout, chain) = (&self.cables[cable], plant.chain(cable));
        let states = self.law_states(cable, internal);
        let first = layout.offset + usize::from(layout.has_length);
        // A cable that follows the rate of its strain has its length among these states, by `InverseDynamics::new`.
        let (chord, mut paid_out) = ([length, speed], [length, speed]);
        if layout.has_length {
            let l = internal[layout.offset];
            paid_out = [l, chain.paid_out_rate(chain.spring(time, length, l, &states), tension, chord, l)];
            rates[layout.offset] = paid_out[1];
        }
        let mut law_rates = [S::from(0.0); MAX_EFFECT_STATES];
        let held = Held { time, chord, paid_out, angular_rate: S::from(0.0), slack: false, states: &states };
        chain.law_rates(tension, &held, &mut law_rates);
        for (k, slot) in layout.slots.iter().enumerate() {
            rates[first + k] = law_rates[*slot];
        }
    }

    fn drive<S: Real>(drive: &Drive, cable: usize) -> [S; 4] {
        [drive.time, drive.length[cable], drive.speed[cable], drive.tension[cable]].map(|j| S::from(j.re))
    }

    pub(super) fn rates(&self, plant: &Plant, drive: &Drive, internal: &[f64], rates: &mut [f64]) {
        for i in 0..plant.cables() {
            self.cable_rates(plant, i, Self::drive(drive, i), internal, rates);
        }
    }

    /// `∂rates/∂internal`, block diagonal by cables.
    fn jacobian(&self, plant: &Plant, drive: &Drive, internal: &[f64]) -> DMatrix<f64> {
        let mut jacobian = DMatrix::zeros(self.dimension, self.dimension);
        let mut point: Vec<Dual64> = internal.iter().map(|v| Dual64::from_re(*v)).collect();
        let mut rates = vec![Dual64::from(0.0); self.dimension];
        for i in 0..plant.cables() {
            let layout = &self.cables[i];
            let range = layout.offset..layout.offset + usize::from(layout.has_length) + layout.slots.len();
            for column in range.clone() {
                point[column].eps = 1.0;
                self.cable_rates(plant, i, Self::drive(drive, i), &point, &mut rates);
                point[column].eps = 0.0;
                for row in range.clone() {
                    jacobian[(row, column)] = rates[row].eps;
                }
            }
        }
        jacobian
    }

    /// Paid-out lengths and law states with derivatives, by repeated evaluation: each round adds one order.
    pub(super) fn jets(&self, plant: &Plant, drive: &Drive, internal: &[f64]) -> ElasticJets {
        let mut point: Vec<Jet> = internal.iter().map(|v| Jet::from(*v)).collect();
        let mut rates = vec![Jet::from(0.0); self.dimension];
        for _ in 0..3 {
            for i in 0..plant.cables() {
                let drive = [drive.time, drive.length[i], drive.speed[i], drive.tension[i]];
                self.cable_rates(plant, i, drive, &point, &mut rates);
            }
            for (x, rate) in point.iter_mut().zip(&rates) {
                *x = Jet::new(x.re, rate.re, rate.v1, rate.v2);
            }
        }
        let states = PerCable::from_fn(plant.cables(), |i| self.law_states(i, &point));
        let unstretched = PerCable::from_fn(plant.cables(), |i| {
            let layout = &self.cables[i];
            if layout.has_length {
                point[layout.offset]
            } else if Self::is_elastic(plant, i) {
                Self::at_rest(plant, i, drive, drive.tension[i], &states[i])
            } else {
                drive.length[i]
            }
        });
        ElasticJets { unstretched, states }
    }

    fn at_rest(plant: &Plant, i: usize, drive: &Drive, tension: Jet, states: &[Jet]) -> Jet {
        plant.chain(i).unstretched_length(drive.time, drive.length[i], tension, states)
    }

    /// Internal states near the slow solution, where there is one: creep settled, spring and damper together carrying the
    /// tension.
    pub(super) fn start(&self, plant: &Plant, drive: &Drive, internal: &mut [f64]) {
        for i in 0..plant.cables() {
            let layout = &self.cables[i];
            let mut settled = [0.0; MAX_EFFECT_STATES];
            for (kind, at) in &plant.cable[i].law {
                kind.start_strain(drive.tension[i].re, &mut settled[*at..]);
            }
            let first = layout.offset + usize::from(layout.has_length);
            for (k, slot) in layout.slots.iter().enumerate() {
                internal[first + k] = settled[*slot];
            }
            if layout.has_length {
                let states = settled.map(Jet::from);
                let rest = Self::at_rest(plant, i, drive, drive.tension[i], &states);
                let data = &plant.data().cables[i];
                // The damper's share follows from the rate of the spring alone; each round is one term of its series.
                let round = |l: Jet| {
                    let rate = Jet::new(l.v1, l.v2, l.v3, 0.0);
                    let damper = plant.chain(i).damper([drive.length[i], drive.speed[i]], [l, rate]);
                    Self::at_rest(plant, i, drive, drive.tension[i] - damper, &states)
                };
                // The series settles where the pole is much faster than the motion; elsewhere the cable starts as at rest.
                let l = if data.axial_stiffness > SLOW_POLE * data.damping { round(round(rest)) } else { rest };
                internal[layout.offset] = l.re;
            }
        }
    }
}

/// The internal states along the trajectory, for the integrator.
pub(super) struct InternalSystem<'a> {
    problem: &'a InverseDynamics<'a>,
    jacobian: DMatrix<f64>,
    factors: DenseFactors,
    failure: Option<InverseError>,
    nominal: Vec<f64>,
}

impl<'a> InternalSystem<'a> {
    pub(super) fn new(problem: &'a InverseDynamics<'a>, internal: &[f64]) -> Self {
        let n = problem.layout.dimension();
        // Lengths to the metre, strains to their own size.
        let nominal = internal.iter().map(|v| if *v == 0.0 { 1e-3 } else { v.abs().min(1.0) }).collect();
        Self { problem, jacobian: DMatrix::zeros(n, n), factors: DenseFactors::default(), failure: None, nominal }
    }

    /// The error that made the rates undefined, if any.
    pub(super) fn failure(&mut self) -> Result<(), InverseError> {
        self.failure.take().map_or(Ok(()), Err)
    }
}

impl System for InternalSystem<'_> {
    fn dimension(&self) -> usize {
        self.problem.layout.dimension()
    }

    fn rates(&mut self, time: f64, y: &[f64], rates: &mut [f64]) {
        if let Err(error) = self.problem.internal_rates(time, y, rates) {
            rates.fill(f64::NAN);
            self.failure.get_or_insert(error);
        }
    }

    fn scale(&self, _y: &[f64], scale: &mut [f64]) {
        scale.copy_from_slice(&self.nominal);
    }

    fn linearise(&mut self, time: f64, y: &[f64]) {
        match self.problem.rigid(time) {
            Ok(rigid) => self.jacobian = self.problem.layout.jacobian(&self.problem.plant, &rigid.elastic(), y),
            Err(error) => {
                self.failure.get_or_insert(error);
            }
        }
    }

    fn factor(&mut self, real: f64, complex: Complex64) {
        self.factors.factor(&self.jacobian, real, complex);
    }

    fn solve_real(&mut self, b: &mut [f64]) {
        self.factors.solve_real(b);
    }

    fn solve_complex(&mut self, re: &mut [f64], im: &mut [f64]) {
        self.factors.solve_complex(re, im);
    }
}
