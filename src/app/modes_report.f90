!> What `igaform --modes N` tells of a model without running it: its lowest frequencies.
module modes_report
  use kinds, only: wp
  use errors, only: error_t, fail
  use text, only: to_text
  use model, only: model_t
  use boundary, only: boundary_t
  use vibration, only: free_frequencies
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
    logical, allocatable :: is_fixed(:, :, :, :)
    real(wp), allocatable :: frequency(:)
    integer :: i

    is_fixed = prescribed_components(model)
    if (count(.not. is_fixed) > max_free) then
      call fail(error, "--modes works on at most "//to_text(max_free)//" free components of "// &
                "control points; this blank has "//to_text(count(.not. is_fixed)))
      return
    end if
    associate (blank => model%bodies%blank)
      frequency = free_frequencies(blank%patch, blank%law, blank%motion%x, blank%mass, is_fixed) &
                  /two_pi
    end associate
    print "(a)", "mode         frequency            period"
    do i = 1, min(n_modes, size(frequency))
      print "(i4, 2(2x, es16.9))", i, frequency(i), 1.0_wp/max(frequency(i), tiny(1.0_wp))
    end do
  end subroutine print_modes

  !> Components of control points, shape (n1, n2, n3, 3), whose velocity the deck prescribes.
  function prescribed_components(model) result(is_fixed)
    type(model_t), intent(in) :: model
    logical, allocatable :: is_fixed(:, :, :, :)
    integer :: i, p

    associate (x => model%bodies%blank%motion%x)
      allocate (is_fixed(size(x, 1), size(x, 2), size(x, 3), 3), source=.false.)
    end associate
    do i = 1, size(model%supports)
      select type (item => model%supports(i)%item)
      type is (boundary_t)
        do p = 1, size(item%points, 2)
          is_fixed(item%points(1, p), item%points(2, p), item%points(3, p), item%component) = .true.
        end do
      end select
    end do
  end function prescribed_components

end module modes_report
