!> Steps of frequencies: free vibration of small amplitude about the state as it is, under stress
!! and in contact. The step takes no time and changes nothing.
module frequency_step
  use kinds, only: wp
  use text, only: to_text, counted
  use failure, only: error_t, fail
  use elastic, only: elastic_t
  use block_law, only: block_law_t
  use vibration, only: fixed_t, trial_amount
  use blank, only: blank_t
  use boundary, only: prescribed_components
  use model, only: model_t
  use unknowns, only: to_components, to_unknowns
  use eigenpairs, only: find_eigenpairs
  use body_parts, only: field_t
  use body_stiffness, only: add_stiffness, bending_guess, body_stiffness_t, field_of, masses_of, &
                            new_body_stiffness
  use bead_stiffness, only: add_bead_stiffness
  use contact_stiffness, only: add_contact_stiffness
  use driven_tools, only: driven_tools_t, new_driven_tools
  use frames, only: results_t, write_frequencies, write_mode
  use run_log, only: run_log_t, log_line
  implicit none
  private

  public :: find_modes

contains

  !> Find the lowest modes, list their frequencies in the log and write both to the result. An
  !! eigenvalue below zero by more than a very low frequency is that of an unstable mode.
  subroutine find_modes(model, has_buffer, results, log, is_file_lost, error)
    type(model_t), intent(inout) :: model          !! stays as it is
    logical, intent(inout) :: has_buffer           !! of BLAS, see `sparse_factor_t`
    type(results_t), intent(inout) :: results
    type(run_log_t), intent(inout) :: log
    logical, intent(out) :: is_file_lost           !! the result cannot be written
    type(error_t), allocatable, intent(out) :: error
    type(body_stiffness_t) :: stiffness
    real(wp), allocatable :: mass(:), values(:), vectors(:, :)
    real(wp) :: guess
    integer :: i

    is_file_lost = .false.
    call find_stiffness(model, stiffness, error)
    if (allocated(error)) return
    associate (blank => model%bodies%blank, n => model%step%n_modes)
      if (n > stiffness%map%n_free) then
        call fail(error, "*FREQUENCY finds at most "//to_text(stiffness%map%n_free)// &
                  " modes of this blank, one for each free component, not "//to_text(n))
        return
      end if
      mass = to_unknowns(stiffness%map, masses_of(blank%parts))/blank%mass_factor
      guess = bending_guess(blank%parts, blank%law)
      call find_eigenpairs(stiffness%matrix, mass, guess, n, values, vectors, error, &
                           has_buffer, model%ranks)
    end associate
    if (allocated(error)) return
    call log_frequencies(log, values)
    if (count(values < -guess) > 0) call log_line(log, "warning: "// &
      counted(count(values < -guess), "unstable mode")//": a part in this state buckles")
    call write_frequencies(results, model%i_step, frequencies_of(values))
    do i = 1, size(values)
      call write_shape(model, stiffness, i, vectors(:, i), results, error)
    end do
    is_file_lost = allocated(error)
  end subroutine find_modes

  !> Stiffness of the state, and of the springs of points in contact.
  subroutine find_stiffness(model, stiffness, error)
    type(model_t), intent(inout) :: model
    type(body_stiffness_t), intent(out) :: stiffness
    type(error_t), allocatable, intent(out) :: error
    type(fixed_t), allocatable :: fixed(:)
    type(driven_tools_t) :: driven

    associate (blank => model%bodies%blank)
      fixed = prescribed_components(blank%parts, model%supports, model%i_step)
      call new_body_stiffness(stiffness, blank%parts, blank%seams, fixed, error, blank%joints)
      if (allocated(error)) return
      ! The stress of such a law is that of the deformation alone, so that its tangent serves.
      if (blank%law%uses_gradient) then
        call add_elastic_stiffness(blank, blank%law, stiffness)
      else
        call add_elastic_stiffness(blank, elastic_t(density=blank%law%density, &
                                   bulk=blank%law%bulk, shear=blank%law%shear), stiffness)
      end if
      call new_driven_tools(driven, model%supports)
      call add_contact_stiffness(stiffness, blank%parts, model%forces, model%bodies%tools, driven)
      call add_bead_stiffness(stiffness, blank%parts, model%forces)
    end associate
  end subroutine find_stiffness

  !> The internal forces, which the differences use up, are kept.
  subroutine add_elastic_stiffness(blank, law, stiffness)
    type(blank_t), intent(inout) :: blank
    class(block_law_t), intent(in) :: law
    type(body_stiffness_t), intent(inout) :: stiffness
    type(field_t) :: forces(size(blank%parts))
    integer :: p

    do p = 1, size(forces)
      forces(p)%values = blank%parts(p)%element%motion%internal_force
    end do
    call add_stiffness(stiffness, blank%parts, law, 1.0_wp, trial_amount(blank%parts), blank%joints)
    do p = 1, size(forces)
      blank%parts(p)%element%motion%internal_force = forces(p)%values
    end do
  end subroutine add_elastic_stiffness

  !> Frequencies [1/time] of the squares of angular ones; 0 where these are not positive.
  elemental real(wp) function frequencies_of(square) result(frequency)
    real(wp), intent(in) :: square
    real(wp), parameter :: two_pi = 2.0_wp*acos(-1.0_wp)

    frequency = sqrt(max(0.0_wp, square))/two_pi
  end function frequencies_of

  subroutine log_frequencies(log, values)
    type(run_log_t), intent(inout) :: log
    real(wp), intent(in) :: values(:)
    character(100) :: line
    real(wp) :: frequency
    integer :: i

    call log_line(log, "modes      mode         frequency            period")
    do i = 1, size(values)
      frequency = frequencies_of(values(i))
      write (line, "(a, i4, 2x, es16.9, 17x, a)") "modes      ", i, frequency, "-"
      if (frequency > 0.0_wp) write (line, "(a, i4, 2(2x, es16.9))") "modes      ", i, frequency, &
        1.0_wp/frequency
      call log_line(log, trim(line))
    end do
  end subroutine log_frequencies

  !> The motion of the control points of all patches, of shells those of both faces, the largest
  !! component 1.
  subroutine write_shape(model, stiffness, number, vector, results, error)
    type(model_t), intent(inout) :: model
    type(body_stiffness_t), intent(in) :: stiffness
    integer, intent(in) :: number
    real(wp), intent(in) :: vector(:)
    type(results_t), intent(inout) :: results
    type(error_t), allocatable, intent(inout) :: error
    type(field_t) :: shapes(size(model%bodies%blank%parts))
    real(wp), allocatable :: components(:), x(:, :, :, :)
    real(wp) :: largest
    integer :: p

    if (allocated(error)) return
    components = to_components(stiffness%map, vector)
    largest = 0.0_wp
    do p = 1, size(shapes)
      associate (element => model%bodies%blank%parts(p)%element)
        element%motion%v = field_of(stiffness, p, shape(element%motion%v), components)
        if (allocated(x)) deallocate (x)
        call element%body_motion(x, shapes(p)%values)
        element%motion%v = 0.0_wp
      end associate
      if (maxval(abs(shapes(p)%values)) <= abs(largest)) cycle
      associate (values => [shapes(p)%values])
        largest = values(maxloc(abs(values), 1))
      end associate
    end do
    do p = 1, size(shapes)
      call write_mode(results, model%i_step, number, p, shapes(p)%values/largest, error)
    end do
  end subroutine write_shape

end module frequency_step
