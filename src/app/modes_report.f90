!> Frequencies of the blank. `igaform --modes N` prints the lowest without running the model;
!! `igaform --check` warns of a bar whose masses make its torsion slow.
!!
!! A row-sum mass puts the mass of an element's inside onto its faces: the second moments of a
!! section of few elements are too large (by 1 + (p + 1)/n^2 or so with n elements of degree p), and
!! with them the polar inertia that resists torsion.
module modes_report
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: to_text
  use model, only: model_t
  use boundary, only: prescribed_components
  use vibration, only: fixed_t, free_frequencies, n_free
  use input_errors, only: origin_t, error_list_t, add_warning
  use symmetric_eigen, only: principal_values
  use vector_product, only: cross
  use point_volumes, only: determinant
  use element, only: element_t
  use blank, only: blank_t
  implicit none
  private

  public :: print_modes, check_torsion

  real(wp), parameter :: slender = 4.0_wp    !! length over the larger width of a bar
  real(wp), parameter :: allowed = 0.1_wp    !! of the frequency of torsion that the masses may take

  !> Second moments of the mass about its centre.
  type :: moments_t
    real(wp) :: mass = 0.0_wp
    real(wp) :: centre(3) = 0.0_wp
    real(wp) :: second(6) = 0.0_wp    !! 11 22 33 12 13 23
  end type moments_t

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

  !> Warn of a bar that can twist and whose frequencies of torsion the masses lower by more than a
  !! tenth.
  subroutine check_torsion(model, origin, errors)
    type(model_t), intent(in) :: model
    type(origin_t), intent(in) :: origin    !! of the blank
    type(error_list_t), intent(inout) :: errors
    type(moments_t) :: lumped, exact
    real(wp) :: axis(3), length, loss

    associate (blank => model%bodies%blank)
      lumped = lumped_moments(blank)
      call find_axis(lumped, axis, length)
      if (length <= 0.0_wp) return
      exact = exact_moments(blank)
      loss = 1.0_wp - sqrt(polar_moment(exact, axis)/polar_moment(lumped, axis))
      if (loss <= allowed) return
      if (is_held(blank, prescribed_components(blank%parts, model%supports, model%i_step), &
                  lumped%centre, axis, length)) return
      call add_warning(errors, origin, "a bar with few elements across, whose lumped masses "// &
                       "lie so far out that its frequencies of torsion are about "// &
                       to_text(nint(100*loss))//" % too low", "more elements across")
    end associate
  end subroutine check_torsion

  !> Of the masses of the control points.
  pure function lumped_moments(blank) result(moments)
    type(blank_t), intent(in) :: blank
    type(moments_t) :: moments
    integer :: p, i, j, k

    do p = 1, size(blank%parts)
      associate (body => blank%parts(p)%element)
        do k = 1, size(body%mass, 3)
          do j = 1, size(body%mass, 2)
            do i = 1, size(body%mass, 1)
              call add_point(body%mass(i, j, k), body%motion%x(i, j, k, :), moments)
            end do
          end do
        end do
      end associate
    end do
    call finish(moments)
  end function lumped_moments

  !> Of the volume, of unit density, by the points of the elements.
  function exact_moments(blank) result(moments)
    type(blank_t), intent(in) :: blank
    type(moments_t) :: moments
    integer :: p

    do p = 1, size(blank%parts)
      call add_part(blank%parts(p)%element, moments)
    end do
    call finish(moments)
  end function exact_moments

  !> A sum for each layer of elements, for threads; then over them in one order.
  subroutine add_part(element, moments)
    class(element_t), intent(in) :: element
    type(moments_t), intent(inout) :: moments
    type(moments_t) :: slices(element%n_elements(1))
    real(wp) :: j(3, 3), x(3), weight
    integer :: e1, e2, e3, q1, q2, q3, n

    !$omp parallel do schedule(static) private(e2, e3, q1, q2, q3, j, x, weight)
    do e1 = 1, element%n_elements(1)
      do e3 = 1, element%n_elements(3)
        do e2 = 1, element%n_elements(2)
          do q3 = 1, element%rule(3)%n
            do q2 = 1, element%rule(2)%n
              do q1 = 1, element%rule(1)%n
                call element%jacobian(element%grid, [e1, e2, e3], [q1, q2, q3], j, x)
                weight = element%rule(1)%weights(q1)*element%rule(2)%weights(q2) &
                         *element%rule(3)%weights(q3)
                call add_point(determinant(j)*weight, x, slices(e1))
              end do
            end do
          end do
        end do
      end do
    end do
    !$omp end parallel do
    do n = 1, size(slices)
      moments%mass = moments%mass + slices(n)%mass
      moments%centre = moments%centre + slices(n)%centre
      moments%second = moments%second + slices(n)%second
    end do
  end subroutine add_part

  !> Add moments about the origin.
  pure subroutine add_point(mass, x, moments)
    real(wp), intent(in) :: mass, x(3)
    type(moments_t), intent(inout) :: moments

    moments%mass = moments%mass + mass
    moments%centre = moments%centre + mass*x
    moments%second = moments%second + mass*[x**2, x(1)*x(2), x(1)*x(3), x(2)*x(3)]
  end subroutine add_point

  !> From sums about the origin to means about the centre.
  pure subroutine finish(moments)
    type(moments_t), intent(inout) :: moments

    moments%centre = moments%centre/moments%mass
    associate (x => moments%centre)
      moments%second = moments%second/moments%mass - [x**2, x(1)*x(2), x(1)*x(3), x(2)*x(3)]
    end associate
  end subroutine finish

  !> The axis of a bar and its length, as that of a box; no length where it is no bar.
  pure subroutine find_axis(moments, axis, length)
    type(moments_t), intent(in) :: moments
    real(wp), intent(out) :: axis(3), length
    real(wp) :: values(3), directions(3, 3)
    integer :: long

    call principal_values(moments%second, values, directions)
    long = maxloc(values, 1)
    axis = directions(:, long)
    values = sqrt(12.0_wp*max(values, 0.0_wp))
    length = values(long)
    if (length < slender*maxval(values, [1, 2, 3] /= long)) length = 0.0_wp
  end subroutine find_axis

  !> Second moment about an axis through the centre, over the mass.
  pure real(wp) function polar_moment(moments, axis)
    type(moments_t), intent(in) :: moments
    real(wp), intent(in) :: axis(3)

    associate (s => moments%second, a => axis)
      polar_moment = sum(s(:3)) - sum(s(:3)*a**2) - 2.0_wp*(s(4)*a(1)*a(2) + s(5)*a(1)*a(3) &
                                                            + s(6)*a(2)*a(3))
    end associate
  end function polar_moment

  !> Do supports keep the bar from twisting all along, in each quarter of its length? Those of a
  !! plane of symmetry do, clamps at its ends do not.
  pure logical function is_held(blank, fixed, centre, axis, length)
    type(blank_t), intent(in) :: blank
    type(fixed_t), intent(in) :: fixed(:)      !! prescribed components, by patch
    real(wp), intent(in) :: centre(3), axis(3), length
    integer, parameter :: n_pieces = 4
    real(wp), parameter :: round_off = 1.0e-6_wp
    logical :: is_piece_held(n_pieces)
    real(wp) :: turn(3), along
    integer :: p, i, j, k, piece

    is_piece_held = .false.
    do p = 1, size(blank%parts)
      associate (x => blank%parts(p)%element%motion%x)
        do k = 1, size(x, 3)
          do j = 1, size(x, 2)
            do i = 1, size(x, 1)
              turn = cross(axis, x(i, j, k, :) - centre)
              if (.not. any(fixed(p)%is_fixed(i, j, k, :) &
                            .and. abs(turn) > round_off*length)) cycle
              along = 0.5_wp + dot_product(axis, x(i, j, k, :) - centre)/length
              piece = max(1, min(n_pieces, 1 + floor(n_pieces*along)))
              is_piece_held(piece) = .true.
            end do
          end do
        end do
      end associate
    end do
    is_held = all(is_piece_held)
  end function is_held

end module modes_report
