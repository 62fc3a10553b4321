!> Closest points on hard tools against brute force: `hard_geometry N` draws N random points for
!! each tool, in the box around it and its reach; `hard_geometry N FIRST LAST` does some tools only.
!!
!! A hit must be a place of the tool, no farther than the best that brute force finds; a point
!! within reach must have one; every search must end well.
program hard_geometry
  use, intrinsic :: iso_fortran_env, only: int64, output_unit
  use kinds, only: wp
  use failure, only: error_t
  use nurbs_surface, only: evaluate_surface
  use tool, only: tool_t, new_tool
  use closest_point, only: hit_t
  use tool_search, only: search_tool
  use brute_force, only: samples_t, new_samples, brute_distance, random_in
  use hard_surfaces, only: hard_case_t, hard_case, n_cases
  implicit none

  !> What the points of a case add up to.
  type :: outcome_t
    integer :: n_lost = 0            !! within reach, but no hit; or a hit beyond reach
    integer :: n_failed = 0          !! searches that did not settle
    real(wp) :: worst = 0.0_wp       !! how much farther than by brute force [length]
    real(wp) :: worst_at(3) = 0.0_wp, failed_at(3) = 0.0_wp   !! points where
    real(wp) :: off = 0.0_wp         !! distance told against that of the place told [length]
    integer :: n_hits = 0
    integer(int64) :: n_iterations = 0
    integer :: max_iterations = 0
  end type outcome_t

  real(wp), parameter :: tolerance = 1.0e-9_wp
  real(wp), parameter :: power_form = 1.0e-8_wp   !! what weights of 0.001 to 1000 leave of digits
  integer :: n_points, i
  logical :: is_good

  n_points = argument(1, 300)
  is_good = .true.
  print "(a)", "tool                                           faces    hits  lost failed   "// &
    "farther       off   mean  most"
  do i = argument(2, 1), argument(3, n_cases)
    call check_case(hard_case(i), n_points, is_good)
    flush (output_unit)
  end do
  if (.not. is_good) error stop "some closest points are wrong"

contains

  !> Number given on the command line, or what stands for it.
  integer function argument(place, default)
    integer, intent(in) :: place, default
    character(16) :: word

    argument = default
    if (command_argument_count() < place) return
    call get_command_argument(place, word)
    read (word, *) argument
  end function argument

  subroutine check_case(hard, n_points, is_good)
    type(hard_case_t), intent(in) :: hard
    integer, intent(in) :: n_points
    logical, intent(inout) :: is_good
    type(tool_t) :: tool
    type(samples_t), allocatable :: samples(:)
    type(error_t), allocatable :: error
    type(outcome_t) :: outcome
    real(wp) :: box(3, 2), x(3)
    integer :: i, seed

    call new_tool(tool, hard%name, hard%surfaces, 1, hard%reach, error)
    allocate (samples(size(hard%surfaces)))
    do i = 1, size(samples)
      samples(i) = new_samples(hard%surfaces(i))
    end do
    box(:, 1) = tool%box(:, 1) - hard%reach
    box(:, 2) = tool%box(:, 2) + hard%reach
    seed = 1
    do i = 1, n_points
      call random_in(box, seed, x)
      if (hard%is_on_middle) x(1) = 0.0_wp
      call check_point(tool, samples, x, outcome)
    end do
    associate (o => outcome)
      print "(a44, i8, i8, i6, i7, 2es10.1, f7.1, i6)", hard%name//repeat(" ", 44), tool%n_faces, &
        o%n_hits, o%n_lost, o%n_failed, o%worst, o%off, &
        real(o%n_iterations, wp)/n_points, o%max_iterations
      if (o%worst >= tolerance) print "(a, 3es24.16)", "    farther at", o%worst_at
      if (o%n_failed > 0) print "(a, 3es24.16)", "    failed at", o%failed_at
      is_good = is_good .and. o%n_lost == 0 .and. o%n_failed == 0 .and. o%n_hits > n_points/10 &
                .and. o%worst < tolerance .and. o%off < power_form
    end associate
  end subroutine check_case

  subroutine check_point(tool, samples, x, outcome)
    type(tool_t), intent(in) :: tool
    type(samples_t), intent(in) :: samples(:)
    real(wp), intent(in) :: x(3)
    type(outcome_t), intent(inout) :: outcome
    type(hit_t) :: hit
    real(wp) :: distance, point(3)
    integer :: i

    call search_tool(tool, x, 0.0_wp, .false., hit)
    distance = minval([(brute_distance(samples(i), x), i=1, size(samples))])
    outcome%n_iterations = outcome%n_iterations + hit%n_iterations
    outcome%max_iterations = max(outcome%max_iterations, hit%n_iterations)
    if (.not. hit%is_converged) outcome%failed_at = x
    if (.not. hit%is_converged) outcome%n_failed = outcome%n_failed + 1
    if (hit%face == 0) then
      if (distance < tool%search_distance - tolerance) outcome%n_lost = outcome%n_lost + 1
      return
    end if
    if (hit%distance > tool%search_distance + tolerance) outcome%n_lost = outcome%n_lost + 1
    outcome%n_hits = outcome%n_hits + 1
    if (hit%distance - distance > outcome%worst) outcome%worst_at = x
    outcome%worst = max(outcome%worst, hit%distance - distance)
    associate (low => tool%low(:, hit%face), high => tool%high(:, hit%face))
      call evaluate_surface(tool%surfaces(tool%surface_of(hit%face)), &
                            low + hit%at*(high - low), point)
    end associate
    outcome%off = max(outcome%off, abs(norm2(x - point) - hit%distance))
  end subroutine check_point

end program hard_geometry
