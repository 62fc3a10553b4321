!> Between control-point fields and blocks of eight elements: gather, weigh, add back.
module block_gather
  use kinds, only: wp
  implicit none
  private

  public :: gather_block, weigh_block, add_block

contains

  !> Control values of eight elements, times a factor; `first` holds the first control point of each
  !! lane along axis 1, `first2` and `first3` those of the row.
  pure subroutine gather_block(p, n, n_fields, is_contiguous, first, first2, first3, factor, &
                               field, u)
    integer, intent(in) :: p(3), n(3), n_fields
    logical, intent(in) :: is_contiguous
    integer, intent(in) :: first(8), first2, first3
    real(wp), intent(in) :: factor, field(n(1), n(2), n(3), n_fields)
    real(wp), intent(out) :: u(8, p(1) + 1, p(2) + 1, p(3) + 1, n_fields)
    integer :: a, j, k, c, l

    if (is_contiguous .and. all(p == 2)) then
      call gather_quadratic(n, n_fields, first(1), first2, first3, factor, field, u)
      return
    else if (is_contiguous .and. all(p == [2, 2, 0])) then
      call gather_shell(n(:2), n_fields, first(1), first2, factor, field, u)
      return
    end if
    do c = 1, n_fields
      do k = 1, p(3) + 1
        do j = 1, p(2) + 1
          do a = 1, p(1) + 1
            if (is_contiguous) then
              !$omp simd
              do l = 1, 8
                u(l, a, j, k, c) = factor*field(first(1) + a + l - 2, first2 + j - 1, &
                                                first3 + k - 1, c)
              end do
            else
              do l = 1, 8
                u(l, a, j, k, c) = factor*field(first(l) + a - 1, first2 + j - 1, &
                                                first3 + k - 1, c)
              end do
            end if
          end do
        end do
      end do
    end do
  end subroutine gather_block

  !> The most common case, with counts that the compiler knows.
  pure subroutine gather_quadratic(n, n_fields, first1, first2, first3, factor, field, u)
    integer, intent(in) :: n(3), n_fields, first1, first2, first3
    real(wp), intent(in) :: factor, field(n(1), n(2), n(3), n_fields)
    real(wp), intent(out) :: u(8, 3, 3, 3, n_fields)
    integer :: j, k, c, l

    do c = 1, n_fields
      do k = 1, 3
        do j = 1, 3
          !$omp simd
          do l = 1, 8
            u(l, 1, j, k, c) = factor*field(first1 + l - 1, first2 + j - 1, first3 + k - 1, c)
            u(l, 2, j, k, c) = factor*field(first1 + l, first2 + j - 1, first3 + k - 1, c)
            u(l, 3, j, k, c) = factor*field(first1 + l + 1, first2 + j - 1, first3 + k - 1, c)
          end do
        end do
      end do
    end do
  end subroutine gather_quadratic

  !> The same of quadratic shells.
  pure subroutine gather_shell(n, n_fields, first1, first2, factor, field, u)
    integer, intent(in) :: n(2), n_fields, first1, first2
    real(wp), intent(in) :: factor, field(n(1), n(2), n_fields)
    real(wp), intent(out) :: u(8, 3, 3, n_fields)
    integer :: j, c, l

    do c = 1, n_fields
      do j = 1, 3
        !$omp simd
        do l = 1, 8
          u(l, 1, j, c) = factor*field(first1 + l - 1, first2 + j - 1, c)
          u(l, 2, j, c) = factor*field(first1 + l, first2 + j - 1, c)
          u(l, 3, j, c) = factor*field(first1 + l + 1, first2 + j - 1, c)
        end do
      end do
    end do
  end subroutine gather_shell

  !> Multiply every field of a block by the weights of its control points.
  pure subroutine weigh_block(n_values, n_fields, weights, u)
    integer, intent(in) :: n_values, n_fields
    real(wp), intent(in) :: weights(n_values)
    real(wp), intent(inout) :: u(n_values, n_fields)
    integer :: c

    do c = 1, n_fields
      u(:, c) = u(:, c)*weights
    end do
  end subroutine weigh_block

  !> Add the block back, lane after lane where control points are shared: `lower` and `upper` bound
  !! the part of axes 1 and 2 that `field` covers, `rows` the functions along axis 2 that are added.
  pure subroutine add_block(p, n_fields, lower, upper, n3, rows, is_contiguous, first, first2, &
                            first3, f, field)
    integer, intent(in) :: p(3), n_fields, lower(2), upper(2), n3, rows(2)
    logical, intent(in) :: is_contiguous
    integer, intent(in) :: first(8), first2, first3
    real(wp), intent(in) :: f(8, p(1) + 1, p(2) + 1, p(3) + 1, n_fields)
    real(wp), intent(inout) :: field(lower(1):upper(1), lower(2):upper(2), n3, n_fields)
    integer :: a, j, k, c, l, i, m2, m3

    if (is_contiguous .and. n_fields == 3 .and. all(p == 2)) then
      call add_quadratic(lower, upper, n3, rows, first(1), first2, first3, f, field)
    else if (is_contiguous .and. all(p == [2, 2, 0])) then
      call add_shell(n_fields, lower, upper, rows, first(1), first2, f, field)
    else if (is_contiguous) then
      ! Axis 1 outermost: the next function along it would read what has just been stored,
      ! shifted by one, which stalls. So it is below.
      do a = 1, p(1) + 1
        i = first(1) + a - 2
        do c = 1, n_fields
          do k = 1, p(3) + 1
            m3 = first3 + k - 1
            do j = rows(1), rows(2)
              m2 = first2 + j - 1
              !$omp simd
              do l = 1, 8
                field(i + l, m2, m3, c) = field(i + l, m2, m3, c) + f(l, a, j, k, c)
              end do
            end do
          end do
        end do
      end do
    else
      do c = 1, n_fields
        do k = 1, p(3) + 1
          m3 = first3 + k - 1
          do j = rows(1), rows(2)
            m2 = first2 + j - 1
            do a = 1, p(1) + 1
              do l = 1, 8
                i = first(l) + a - 1
                field(i, m2, m3, c) = field(i, m2, m3, c) + f(l, a, j, k, c)
              end do
            end do
          end do
        end do
      end do
    end if
  end subroutine add_block

  !> The most common case, with counts that the compiler knows.
  pure subroutine add_quadratic(lower, upper, n3, rows, first1, first2, first3, f, field)
    integer, intent(in) :: lower(2), upper(2), n3, rows(2), first1, first2, first3
    real(wp), intent(in) :: f(8, 3, 3, 3, 3)
    real(wp), intent(inout) :: field(lower(1):upper(1), lower(2):upper(2), n3, 3)
    integer :: a, j, k, c, l

    do a = 0, 2
      do j = rows(1), rows(2)
        do c = 1, 3
          do k = 1, 3
            associate (i => first1 + a - 1, m2 => first2 + j - 1, m3 => first3 + k - 1)
              !$omp simd
              do l = 1, 8
                field(i + l, m2, m3, c) = field(i + l, m2, m3, c) + f(l, a + 1, j, k, c)
              end do
            end associate
          end do
        end do
      end do
    end do
  end subroutine add_quadratic

  !> The same of quadratic shells.
  pure subroutine add_shell(n_fields, lower, upper, rows, first1, first2, f, field)
    integer, intent(in) :: n_fields, lower(2), upper(2), rows(2), first1, first2
    real(wp), intent(in) :: f(8, 3, 3, n_fields)
    real(wp), intent(inout) :: field(lower(1):upper(1), lower(2):upper(2), n_fields)
    integer :: a, j, c, l

    do a = 0, 2
      do j = rows(1), rows(2)
        do c = 1, n_fields
          associate (i => first1 + a - 1, m => first2 + j - 1)
            !$omp simd
            do l = 1, 8
              field(i + l, m, c) = field(i + l, m, c) + f(l, a + 1, j, c)
            end do
          end associate
        end do
      end do
    end do
  end subroutine add_shell

end module block_gather