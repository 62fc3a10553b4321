!> What the static steps of a deck will cost: equations, memory of the factors, time. The pattern of
!! the matrix is analysed and one force evaluation timed; iterations are those of similar runs.
module static_outlook
  use, intrinsic :: iso_fortran_env, only: int64
  use omp_lib, only: omp_get_max_threads, omp_set_num_threads
  use kinds, only: wp
  use failure, only: error_t
  use text, only: string_t, append_text, counted, rounded_text
  use element, only: part_t
  use body_parts, only: end_forces_of_parts
  use boundary, only: prescribed_components
  use vibration, only: fixed_t
  use model, only: model_t
  use contact_effect, only: contact_pairs, contact_view_t
  use static_increments, only: count_increments
  use body_stiffness, only: body_stiffness_t, n_evaluations, new_body_stiffness
  use sparse_factor, only: sparse_factor_t
  implicit none
  private

  public :: static_lines

  real(wp), parameter :: factor_rate = 2.0e10_wp   !! operations a second, see docs/developing.md
  !> Iterations of an increment, each with a matrix of its own: of springback, and in contact.
  real(wp), parameter :: of_springback = 7.0_wp, in_contact = 13.0_wp

contains

  !> Lines on the static steps, none where there are none, and the processor time that they should
  !! take [s]. The forces are evaluated once where `may_step` allows it; else the time is 0.
  subroutine static_lines(model, may_step, lines, seconds)
    type(model_t), intent(inout) :: model         !! stays as it is, but for its internal forces
    logical, intent(in) :: may_step
    type(string_t), allocatable, intent(out) :: lines(:)
    real(wp), intent(out) :: seconds
    type(body_stiffness_t) :: stiffness
    type(sparse_factor_t) :: factor
    type(error_t), allocatable :: error
    type(fixed_t), allocatable :: fixed(:)
    real(wp) :: of_matrix
    integer :: n_steps
    integer(int64) :: n_increments

    allocate (lines(0))
    seconds = 0.0_wp
    call count_increments(model, n_steps, n_increments)
    if (n_steps == 0) return
    fixed = held_components(model)
    associate (blank => model%bodies%blank)
      call new_body_stiffness(stiffness, blank%parts, blank%seams, fixed, error, blank%joints)
    end associate
    if (.not. allocated(error)) call factor%analyse(stiffness%matrix, error)
    if (allocated(error)) then
      call append_text(lines, "static steps     "//error%message)
      return
    end if
    call append_text(lines, "static steps     "//counted(n_steps, "step")//", about "// &
      counted(n_increments, "increment")//"; "//counted(stiffness%matrix%n, "equation")// &
      ", factors "//rounded_text(1.0e-3_wp*factor%megabytes)//" GB"// &
      trim(merge(", the rest on disk", "                  ", allocated(factor%folder))))
    if (.not. may_step) return
    of_matrix = n_evaluations(stiffness, model%bodies%blank%parts)*evaluation_seconds(model) &
                + real(factor%n_operations, wp)/factor_rate
    seconds = real(n_increments, wp)*of_matrix*merge(in_contact, of_springback, has_contact(model))
    call append_text(lines, "                 about "//rounded_text(seconds)// &
      " s of processor time, "//rounded_text(of_matrix)//" s for a matrix and its factors")
  end subroutine static_lines

  !> What supports hold in the first static step.
  function held_components(model) result(fixed)
    type(model_t), intent(in) :: model
    type(fixed_t), allocatable :: fixed(:)
    type(fixed_t), allocatable :: later(:)
    integer :: step, i, p

    step = model%i_step
    do i = size(model%later_steps), 1, -1
      if (model%later_steps(i)%step%is_static) step = model%i_step + i
    end do
    if (model%step%is_static) step = model%i_step
    associate (parts => model%bodies%blank%parts)
      fixed = prescribed_components(parts, model%supports, step)
      later = prescribed_components(parts, model%later_supports, step)
    end associate
    do p = 1, size(fixed)
      fixed(p)%is_fixed = fixed(p)%is_fixed .or. later(p)%is_fixed
      if (.not. allocated(fixed(p)%leader) .and. allocated(later(p)%leader)) &
        fixed(p)%leader = later(p)%leader
    end do
  end function held_components

  !> Is there contact in a static step?
  logical function has_contact(model)
    type(model_t), intent(in), target :: model
    type(contact_view_t), allocatable :: pairs(:), later(:)
    integer :: i

    pairs = contact_pairs(model%forces)
    later = contact_pairs(model%later_forces)
    has_contact = model%step%is_static .and. size(pairs) > 0
    do i = 1, size(model%later_steps)
      if (model%later_steps(i)%step%is_static) &
        has_contact = has_contact .or. acts(pairs, model%i_step + i) .or. &
                      acts(later, model%i_step + i)
    end do
  end function has_contact

  pure logical function acts(pairs, step)
    type(contact_view_t), intent(in) :: pairs(:)
    integer, intent(in) :: step
    integer :: i

    acts = .false.
    do i = 1, size(pairs)
      acts = acts .or. (pairs(i)%pair%first_step <= step .and. pairs(i)%pair%last_step >= step)
    end do
  end function acts

  !> Processor time of one evaluation of all internal forces, by one thread.
  real(wp) function evaluation_seconds(model) result(seconds)
    type(model_t), intent(inout) :: model
    integer, parameter :: n = 3
    real(wp) :: start, finish
    integer :: i, n_threads

    n_threads = omp_get_max_threads()
    call omp_set_num_threads(1)   ! for its processor time to be work
    associate (blank => model%bodies%blank)
      call end_forces_of_parts(blank%parts, blank%law, model%stable_step, blank%report, &
                               blank%joints)
      call cpu_time(start)
      do i = 1, n
        call end_forces_of_parts(blank%parts, blank%law, model%stable_step, blank%report, &
                                 blank%joints)
      end do
      call cpu_time(finish)
    end associate
    call omp_set_num_threads(n_threads)
    seconds = (finish - start)/n
  end function evaluation_seconds

end module static_outlook
