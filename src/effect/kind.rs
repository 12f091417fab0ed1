//! Any effect of the catalogue: its hooks, by static dispatch.

use super::{
    Effect, EffectInfo, EffectKind, LawPart, PlatformContext, Stage, StrainContext, SwingContext, WinchContext,
};
use crate::dynamics::PlantData;
use crate::length_sensor::Drum;
use crate::per_cable::PerCable;
use crate::pose_sensor::PoseSensor;
use crate::scalar::Real;
use crate::winch::WinchCommand;

#[expect(missing_docs, reason = "the same hooks as in the trait")]
impl EffectKind {
    pub fn info(&self) -> &'static EffectInfo {
        fn of<E: Effect>(_: &E) -> &'static EffectInfo {
            const { &E::INFO }
        }
        dispatch!(self, e => of(e))
    }

    pub fn stage(&self) -> Stage {
        dispatch!(self, e => e.stage())
    }

    pub fn states(&self) -> usize {
        dispatch!(self, e => e.states())
    }

    pub(crate) fn sets_what_others_scale(&self) -> bool {
        fn of<E: Effect>(_: &E) -> bool {
            E::SETS_WHAT_OTHERS_SCALE
        }
        dispatch!(self, e => of(e))
    }

    pub(crate) fn no_inverse(&self) -> Option<&'static str> {
        fn of<E: Effect>(_: &E) -> Option<&'static str> {
            E::NO_INVERSE
        }
        dispatch!(self, e => of(e))
    }

    pub(crate) fn check_command(&self, command: WinchCommand) -> Result<(), String> {
        dispatch!(self, e => e.check_command(command))
    }

    pub fn change(&self, data: &mut PlantData, cables: &PerCable<bool>) {
        dispatch!(self, e => e.change(data, cables))
    }

    pub(crate) fn check_length(&self, longest: f64) -> Result<(), String> {
        dispatch!(self, e => e.check_length(longest))
    }

    pub fn delay(&self) -> f64 {
        dispatch!(self, e => e.delay())
    }

    #[inline]
    pub fn command<S: Real>(&self, force: S, states: &[S], rates: &mut [S], context: &WinchContext<S>) -> S {
        dispatch!(self, e => e.command(force, states, rates, context))
    }

    pub fn start_command(&self, force: f64, states: &mut [f64]) {
        dispatch!(self, e => e.start_command(force, states))
    }

    #[inline]
    pub fn loss<S: Real>(&self, force: S, context: &WinchContext<S>) -> S {
        dispatch!(self, e => e.loss(force, context))
    }

    #[inline]
    pub fn loss_in<S: Real>(&self, force: S, states: &[S], rates: &mut [S], context: &WinchContext<S>) -> S {
        dispatch!(self, e => e.loss_in(force, states, rates, context))
    }

    pub fn loss_state_size(&self) -> f64 {
        dispatch!(self, e => e.loss_state_size())
    }

    #[inline]
    pub fn length_factor<S: Real>(&self, time: S) -> S {
        dispatch!(self, e => e.length_factor(time))
    }

    #[inline]
    pub fn inelastic_strain<S: Real>(&self, states: &[S]) -> S {
        dispatch!(self, e => e.inelastic_strain(states))
    }

    #[inline]
    pub fn tension_factor<S: Real>(&self, strain: S, chord: S, axial_stiffness: f64) -> S {
        dispatch!(self, e => e.tension_factor(strain, chord, axial_stiffness))
    }

    #[inline]
    pub fn chord_strain<S: Real>(&self, tension: S, chord: S, unstretched: S) -> S {
        dispatch!(self, e => e.chord_strain(tension, chord, unstretched))
    }

    #[inline]
    pub fn chord_strain_and_slope(&self, tension: f64, chord: f64, unstretched: f64) -> [f64; 2] {
        dispatch!(self, e => e.chord_strain_and_slope(tension, chord, unstretched))
    }

    pub(crate) fn law_parts(&self) -> &'static [LawPart] {
        dispatch!(self, e => e.law_parts())
    }

    #[inline]
    pub fn held_tension<S: Real>(&self, states: &[S]) -> S {
        dispatch!(self, e => e.held_tension(states))
    }

    #[inline]
    pub fn strain_rates<S: Real>(&self, context: &StrainContext<S>, states: &[S], rates: &mut [S]) {
        dispatch!(self, e => e.strain_rates(context, states, rates))
    }

    pub fn follows_strain_rate(&self) -> bool {
        dispatch!(self, e => e.follows_strain_rate())
    }

    pub fn start_strain(&self, tension: f64, states: &mut [f64]) {
        dispatch!(self, e => e.start_strain(tension, states))
    }

    #[inline]
    pub fn transverse_force<S: Real>(&self, length: S, angular_rate: S) -> S {
        dispatch!(self, e => e.transverse_force(length, angular_rate))
    }

    #[inline]
    pub fn swing<S: Real>(&self, context: &SwingContext<S>, states: &[S], rates: &mut [S]) -> S {
        dispatch!(self, e => e.swing(context, states, rates))
    }

    pub fn start_swing(&self, length: f64, angular_rate: f64, states: &mut [f64]) {
        dispatch!(self, e => e.start_swing(length, angular_rate, states))
    }

    #[inline]
    pub fn swing_energy<S: Real>(&self, length: S, states: &[S]) -> S {
        dispatch!(self, e => e.swing_energy(length, states))
    }

    #[inline]
    pub fn bowed_length<S: Real>(&self, chord: S, states: &[S]) -> S {
        dispatch!(self, e => e.bowed_length(chord, states))
    }

    #[inline]
    pub fn pull<S: Real>(&self, context: &PlatformContext<'_, S>, cable: usize) -> S {
        dispatch!(self, e => e.pull(context, cable))
    }

    #[inline]
    pub fn wrench<S: Real>(&self, context: &PlatformContext<'_, S>) -> [S; 3] {
        dispatch!(self, e => e.wrench(context))
    }

    pub fn length_sensor(&self) -> (f64, f64) {
        dispatch!(self, e => e.length_sensor())
    }

    pub fn drum(&self, drum: &mut Drum) {
        dispatch!(self, e => e.drum(drum));
    }

    pub fn tension_sensor(&self) -> (f64, f64) {
        dispatch!(self, e => e.tension_sensor())
    }

    pub fn pose_sensor(&self, sensor: &mut PoseSensor) {
        dispatch!(self, e => e.pose_sensor(sensor))
    }
}
