!> Dynamic relaxation: damping that leads a motion to rest, and the test whether it has got there.
module relaxation
  use kinds, only: wp
  use text, only: rounded_text
  use assembly, only: assembly_t
  use effect, only: instant_t
  use column_scaling, only: column_directions, column_differences
  use damping, only: damping_t, damp, velocities_before
  implicit none
  private

  !> Damping chosen anew in every step. `is_kinetic`: none, but all motion stops where the kinetic
  !! energy has passed a maximum (P. A. Cundall, Explicit finite-difference methods in
  !! geomechanics, 1976). Otherwise critical for the frequency that the motion has now, the Rayleigh
  !! quotient of the last step (P. Underwood, Dynamic relaxation, in: Computational methods for
  !! transient analysis, 1983). At rest is where the kinetic energy is small beside the largest
  !! internal energy of the run, and the unbalanced force beside its largest force.
  type, extends(damping_t), public :: relaxation_t
    logical :: is_kinetic = .false.
    real(wp) :: energy_limit = 0.0_wp, force_limit = 0.0_wp   !! relative
    real(wp) :: settled_from = 0.0_wp              !! time from which loads are constant
    real(wp), allocatable :: is_free(:, :, :, :)   !! 1, and 0 where a support holds the component
    real(wp), allocatable :: internal_force(:, :, :, :)   !! of the last step
    real(wp) :: internal_energy = 0.0_wp, kinetic_energy = 0.0_wp
    real(wp) :: peak_energy = 0.0_wp               !! kinetic, at the last stop
    real(wp) :: largest_energy = 0.0_wp, largest_force = 0.0_wp
    real(wp) :: energy_residual = huge(1.0_wp), force_residual = huge(1.0_wp)   !! relative, now
    real(wp) :: settled_at = 0.0_wp                !! time of rest, where `is_done`
  contains
    procedure :: apply
    procedure :: outcome
  end type relaxation_t

contains

  !> Look at the motion, damp it, and tell whether it has come to rest.
  subroutine apply(self, bodies, instant)
    class(relaxation_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant
    real(wp) :: alpha, kinetic, stiffness, inertia

    if (self%is_done) then
      call damp(self, bodies, instant, 0.0_wp)
      return
    end if
    call look(self, bodies, instant, stiffness, inertia)
    kinetic = 0.5_wp*inertia
    if (self%is_kinetic) then
      ! The motion that a stop has ended tells how far from rest the blank was.
      alpha = 0.0_wp
      if (kinetic < self%kinetic_energy) then
        alpha = 2.0_wp/instant%dt_mean
        self%peak_energy = self%kinetic_energy
        kinetic = 0.0_wp
      end if
      self%kinetic_energy = kinetic
      kinetic = max(kinetic, self%peak_energy)
    else
      alpha = 2.0_wp*sqrt(max(stiffness, 0.0_wp)/max(inertia, tiny(1.0_wp)))
    end if
    self%energy_residual = kinetic/max(self%largest_energy, tiny(1.0_wp))
    call damp(self, bodies, instant, alpha)
    if (instant%time < self%settled_from) return
    self%is_done = self%energy_residual <= self%energy_limit .and. &
                   self%force_residual <= self%force_limit
    if (self%is_done) self%settled_at = instant%time
  end subroutine apply

  !> Residual of the forces; numerator and denominator of the Rayleigh quotient of the last step.
  subroutine look(self, bodies, instant, stiffness, inertia)
    class(relaxation_t), intent(inout) :: self
    type(assembly_t), intent(in) :: bodies
    type(instant_t), intent(in) :: instant
    real(wp), intent(out) :: stiffness, inertia
    real(wp), allocatable :: v_before(:, :, :, :)
    real(wp) :: unbalanced
    integer :: c

    associate (motion => bodies%blank%motion, mass => bodies%blank%mass)
      if (.not. allocated(self%internal_force)) &
        allocate (self%internal_force, source=motion%internal_force)
      v_before = velocities_before(bodies, instant)
      stiffness = sum(v_before*(motion%internal_force - self%internal_force)) &
                  /max(2.0_wp*instant%dt_mean - instant%dt, tiny(1.0_wp))
      inertia = 0.0_wp
      do c = 1, 3
        inertia = inertia + sum(mass*v_before(:, :, :, c)**2)
      end do
      if (allocated(bodies%blank%column_factor)) &
        inertia = inertia + column_inertia(bodies, v_before)
      self%internal_force = motion%internal_force
      unbalanced = norm2(self%is_free*(motion%external_force - motion%internal_force))
      self%internal_energy = self%internal_energy + bodies%blank%report%internal_work
      self%largest_energy = max(self%largest_energy, abs(self%internal_energy))
      self%largest_force = max(self%largest_force, norm2(motion%internal_force), &
                               norm2(motion%external_force))
    end associate
    self%force_residual = unbalanced/max(self%largest_force, tiny(1.0_wp))
  end subroutine look

  !> What scaled columns add to the sum of mass times squared velocity.
  pure real(wp) function column_inertia(bodies, v) result(inertia)
    type(assembly_t), intent(in) :: bodies
    real(wp), intent(in) :: v(:, :, :, :)
    real(wp), allocatable :: differences(:, :, :)
    integer :: k

    inertia = 0.0_wp
    associate (blank => bodies%blank)
      differences = column_differences(blank%mass, column_directions(blank%motion%x), v)
      do k = 1, size(differences, 3)
        inertia = inertia + sum((blank%column_factor - 1.0_wp)*blank%mass(:, :, k) &
                                *differences(:, :, k)**2)
      end do
    end associate
  end function column_inertia

  !> How it went, in words.
  function outcome(self) result(words)
    class(relaxation_t), intent(in) :: self
    character(:), allocatable :: words

    words = "not at rest"
    if (self%is_done) words = "at rest from time "//rounded_text(self%settled_at)//" on"
    words = words//": kinetic energy "//rounded_text(self%energy_residual)//" of the internal "// &
            "energy (limit "//rounded_text(self%energy_limit)//"), unbalanced force "// &
            rounded_text(self%force_residual)//" (limit "//rounded_text(self%force_limit)//")"
  end function outcome

end module relaxation
