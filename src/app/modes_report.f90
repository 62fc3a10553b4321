!> What `igaform --modes N` tells of a model without running it: its lowest frequencies.
module modes_report
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: to_text
  use model, only: model_t
  use boundary, only: prescribed_components
  use vibration, only: fixed_t, free_frequencies, n_free
  implicit none
  private

  public :: print_modes

  !> Free components that one may ask for: the matrix of so many takes 0.2 GB, its eigenvalues
  !! minutes.
  integer, parameter :: max_free = 5000

contains

  !> The lowest frequencies and periods of the blank in its shape at the start, without stress and
  !! contact, to standard output. Components with a prescribed velocity are fixed. Refused, with
  !! nothing printed: a blank with more than 5000 free components.
  subroutine print_modes(model, n_modes, error)
    type(model_t), intent(in) :: model
    integer, intent(in) :: n_modes
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: two_pi = 2.0_wp*acos(-1.0_wp)
    type(fixed_t), allocatable :: fixed(:)
    real(wp), allocatable :: frequency(:)
    integer :: i, n

    fixed = prescribed_components(model%bodies%blank%parts, model%supports, model%i_step)
    n = n_free(model%bodies%blank%parts, model%bodies%blank%seams, fixed)
    if (n > max_free) then
      call fail(error, "--modes works on at most "//to_text(max_free)//" free components of "// &
                "control points; this blank has "//to_text(n))
      return
    end if
    associate (blank => model%bodies%blank)
      frequency = free_frequencies(blank%parts, blank%seams, blank%law, fixed)/two_pi
    end associate
    print "(a)", "mode         frequency            period"
    do i = 1, min(n_modes, size(frequency))
      print "(i4, 2(2x, es16.9))", i, frequency(i), 1.0_wp/max(frequency(i), tiny(1.0_wp))
    end do
  end subroutine print_modes

end module modes_report
